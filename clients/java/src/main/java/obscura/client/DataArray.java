// SPDX-License-Identifier: Apache-2.0
package obscura.client;

import java.nio.ByteBuffer;
import java.nio.ByteOrder;
import java.nio.FloatBuffer;
import java.nio.ShortBuffer;
import java.util.ArrayList;
import java.util.List;
import java.util.Map;

/**
 * An array of an answer, as it stands in the buffer that was received (unless it was compressed): little-endian, last index
 * fastest.
 *
 * @param name what it holds: "irradiance", "depth_m", ...
 * @param dtype type of its numbers as numpy writes it: "&lt;f4", "&lt;u2"
 * @param shape numbers along each axis
 * @param bytes its bytes, from position 0
 */
public record DataArray(String name, String dtype, List<Integer> shape, ByteBuffer bytes) {
    /** Its bytes; position and limit are the caller's own. */
    @Override
    public ByteBuffer bytes() {
        return bytes.duplicate();
    }

    /** View of float32 numbers. Throws IllegalStateException for other types. */
    public FloatBuffer floats() {
        expect("<f4");
        return bytes.duplicate().order(ByteOrder.LITTLE_ENDIAN).asFloatBuffer();
    }

    /** View of unsigned 16-bit numbers; {@code Short.toUnsignedInt} makes numbers of them. Throws IllegalStateException. */
    public ShortBuffer shorts() {
        expect("<u2");
        return bytes.duplicate().order(ByteOrder.LITTLE_ENDIAN).asShortBuffer();
    }

    private void expect(String wanted) {
        if (!dtype.equals(wanted)) throw new IllegalStateException(name + " has numbers of type " + dtype + ", not " + wanted);
    }

    /** The arrays that the row `arrays` of a head tells of. Throws IllegalArgumentException if they are not in the body. */
    static List<DataArray> of(Object rows, ByteBuffer body) {
        List<DataArray> arrays = new ArrayList<>();
        if (rows == null) return arrays;
        for (Object each : (List<?>) rows) {
            Map<?, ?> row = (Map<?, ?>) each;
            long offset = (Long) row.get("offset");
            long count = (Long) row.get("bytes");
            if (offset < 0 || count < 0 || offset > body.capacity() - count)
                throw new IllegalArgumentException("an array outside the message");
            List<Integer> shape = new ArrayList<>();
            long numbers = 1;
            for (Object extent : (List<?>) row.get("shape")) {
                shape.add(Math.toIntExact((Long) extent));
                numbers = Math.multiplyExact(numbers, (long) (Long) extent);
            }
            String dtype = (String) row.get("dtype");
            int elementBytes = dtype.charAt(dtype.length() - 1) - '0';
            int plain = Math.toIntExact(Math.multiplyExact(numbers, (long) elementBytes));
            ByteBuffer bytes = Codecs.decode((String) row.get("codec"), body.slice((int) offset, (int) count), elementBytes, plain);
            if (bytes.capacity() != plain) throw new IllegalArgumentException("an array whose shape is not that of its bytes");
            arrays.add(new DataArray((String) row.get("name"), dtype, List.copyOf(shape), bytes));
        }
        return arrays;
    }
}
