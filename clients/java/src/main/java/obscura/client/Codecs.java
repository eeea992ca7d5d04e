// SPDX-License-Identifier: Apache-2.0
package obscura.client;

import java.nio.ByteBuffer;

/** Compressed arrays: bytes sorted by their place in the element, then one LZ4 block. */
final class Codecs {
    static final String NONE = "none";
    static final String SHUFFLE_LZ4 = "shuffle-lz4";

    private static final int SHORTEST_MATCH = 4;
    /** A block never holds more than 255 times its own bytes. */
    private static final long MOST_RATIO = 255;

    private Codecs() {}

    /**
     * The array as it stands in memory.
     *
     * @param elementBytes bytes of an element
     * @param bytes bytes of the array
     * @throws IllegalArgumentException for other codecs, and for what is no such array
     */
    static ByteBuffer decode(String codec, ByteBuffer data, int elementBytes, int bytes) {
        if (NONE.equals(codec)) return data;
        if (!SHUFFLE_LZ4.equals(codec)) throw new IllegalArgumentException("an array with the codec " + codec);
        if (bytes > MOST_RATIO * data.remaining()) throw new IllegalArgumentException("an LZ4 block that is too short");
        byte[] sorted = new byte[bytes];
        try {
            if (lz4(data.duplicate(), sorted) != bytes) throw new IllegalArgumentException("an LZ4 block of another size");
        } catch (RuntimeException error) { // beyond the end of one or the other
            throw new IllegalArgumentException("an LZ4 block that is broken", error);
        }
        int count = bytes / elementBytes;
        byte[] plain = new byte[bytes];
        for (int place = 0; place < elementBytes; ++place)
            for (int i = 0; i < count; ++i) plain[i * elementBytes + place] = sorted[place * count + i];
        return ByteBuffer.wrap(plain);
    }

    /** Bytes that the LZ4 block has; they are put into `out`. */
    private static int lz4(ByteBuffer in, byte[] out) {
        int at = 0;
        while (true) {
            int token = in.get() & 0xFF;
            int literals = length(in, token >>> 4);
            in.get(out, at, literals);
            at += literals;
            if (!in.hasRemaining()) return at; // the last sequence has no match
            int distance = (in.get() & 0xFF) | (in.get() & 0xFF) << 8;
            int match = length(in, token & 15) + SHORTEST_MATCH;
            if (distance == 0) throw new IllegalArgumentException("a match at distance 0");
            for (int end = Math.addExact(at, match); at < end; ++at) out[at] = out[at - distance]; // may overlap
        }
    }

    private static int length(ByteBuffer in, int nibble) {
        int length = nibble;
        if (nibble < 15) return length;
        int more;
        do {
            more = in.get() & 0xFF;
            length = Math.addExact(length, more);
        } while (more == 255);
        return length;
    }
}
