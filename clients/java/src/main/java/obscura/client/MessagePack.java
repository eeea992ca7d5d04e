// SPDX-License-Identifier: Apache-2.0
package obscura.client;

import java.lang.reflect.Array;
import java.nio.BufferUnderflowException;
import java.nio.ByteBuffer;
import java.nio.charset.CharacterCodingException;
import java.nio.charset.StandardCharsets;
import java.util.ArrayList;
import java.util.Arrays;
import java.util.LinkedHashMap;
import java.util.List;
import java.util.Map;

/** MessagePack of message heads: null, Boolean, Long, Double, String, List and Map with String keys. */
final class MessagePack {
    static final int DEEPEST = 16;

    private MessagePack() {}

    /** The value as MessagePack; also takes any Number, CharSequence, Iterable and array. */
    static ByteBuffer pack(Object value) {
        Writer writer = new Writer();
        writer.put(value, 0);
        return writer.out.flip();
    }

    /**
     * The one value that the buffer holds.
     *
     * @throws IllegalArgumentException if it is not whole, goes on behind it, or is too deep
     */
    static Object unpack(ByteBuffer data) {
        try {
            Object value = read(data, 0);
            if (data.hasRemaining()) throw new IllegalArgumentException("not MessagePack: bytes behind its end");
            return value;
        } catch (BufferUnderflowException | CharacterCodingException error) {
            throw new IllegalArgumentException("not MessagePack: it ends early or has text that is no UTF-8");
        }
    }

    private static final class Writer {
        ByteBuffer out = ByteBuffer.allocate(256);

        private ByteBuffer room(int bytes) {
            if (out.remaining() < bytes)
                out = ByteBuffer.wrap(Arrays.copyOf(out.array(), Math.max(2 * out.capacity(), out.position() + bytes)))
                        .position(out.position());
            return out;
        }

        /** Head of a string, array or map; `code16` and `code32` are its codes of 16 and 32 bits. */
        private void size(int count, int fix, int fixMost, int code8, int code16, int code32) {
            room(5);
            if (count <= fixMost) out.put((byte) (fix | count));
            else if (code8 != 0 && count <= 0xFF) out.put((byte) code8).put((byte) count);
            else if (count <= 0xFFFF) out.put((byte) code16).putShort((short) count);
            else out.put((byte) code32).putInt(count);
        }

        private void put(Object value, int depth) {
            if (depth > DEEPEST) throw new IllegalArgumentException("more than " + DEEPEST + " levels");
            if (value == null) {
                room(1).put((byte) 0xC0);
            } else if (value instanceof Boolean truth) {
                room(1).put((byte) (truth ? 0xC3 : 0xC2));
            } else if (value instanceof Double || value instanceof Float) {
                room(9).put((byte) 0xCB).putDouble(((Number) value).doubleValue());
            } else if (value instanceof Long || value instanceof Integer || value instanceof Short || value instanceof Byte) {
                putInteger(((Number) value).longValue());
            } else if (value instanceof CharSequence text) {
                byte[] bytes = text.toString().getBytes(StandardCharsets.UTF_8);
                size(bytes.length, 0xA0, 31, 0xD9, 0xDA, 0xDB);
                room(bytes.length).put(bytes);
            } else if (value instanceof Iterable<?> items) {
                putItems(items, depth);
            } else if (value.getClass().isArray()) {
                int count = Array.getLength(value);
                size(count, 0x90, 15, 0, 0xDC, 0xDD);
                for (int i = 0; i < count; ++i) put(Array.get(value, i), depth + 1);
            } else if (value instanceof Map<?, ?> members) {
                size(members.size(), 0x80, 15, 0, 0xDE, 0xDF);
                for (Map.Entry<?, ?> member : members.entrySet()) {
                    if (!(member.getKey() instanceof String name))
                        throw new IllegalArgumentException("the key " + member.getKey() + " is no string");
                    put(name, depth + 1);
                    put(member.getValue(), depth + 1);
                }
            } else {
                throw new IllegalArgumentException(value.getClass().getName() + " cannot be sent");
            }
        }

        private void putInteger(long value) {
            if (value >= 0 && value < 128) room(1).put((byte) value);
            else room(9).put((byte) 0xD3).putLong(value);
        }

        private void putItems(Iterable<?> items, int depth) {
            List<Object> all = new ArrayList<>();
            items.forEach(all::add);
            size(all.size(), 0x90, 15, 0, 0xDC, 0xDD);
            for (Object item : all) put(item, depth + 1);
        }
    }

    private static Object read(ByteBuffer data, int depth) throws CharacterCodingException {
        if (depth > DEEPEST) throw new IllegalArgumentException("not MessagePack: more than " + DEEPEST + " levels");
        int code = data.get() & 0xFF;
        if (code < 0x80) return (long) code;
        if (code >= 0xE0) return (long) (byte) code;
        if (code < 0x90) return readMap(data, code & 15, depth);
        if (code < 0xA0) return readList(data, code & 15, depth);
        if (code < 0xC0) return readText(data, code & 31);
        return switch (code) {
            case 0xC0 -> null;
            case 0xC2 -> false;
            case 0xC3 -> true;
            case 0xCA -> (double) data.getFloat();
            case 0xCB -> data.getDouble();
            case 0xCC -> data.get() & 0xFFL;
            case 0xCD -> data.getShort() & 0xFFFFL;
            case 0xCE -> data.getInt() & 0xFFFFFFFFL;
            case 0xCF -> unsigned(data.getLong());
            case 0xD0 -> (long) data.get();
            case 0xD1 -> (long) data.getShort();
            case 0xD2 -> (long) data.getInt();
            case 0xD3 -> data.getLong();
            case 0xD9 -> readText(data, data.get() & 0xFFL);
            case 0xDA -> readText(data, data.getShort() & 0xFFFFL);
            case 0xDB -> readText(data, data.getInt() & 0xFFFFFFFFL);
            case 0xDC -> readList(data, data.getShort() & 0xFFFFL, depth);
            case 0xDD -> readList(data, data.getInt() & 0xFFFFFFFFL, depth);
            case 0xDE -> readMap(data, data.getShort() & 0xFFFFL, depth);
            case 0xDF -> readMap(data, data.getInt() & 0xFFFFFFFFL, depth);
            default -> throw new IllegalArgumentException(String.format("not MessagePack of a head: code %#x", code));
        };
    }

    private static long unsigned(long value) {
        if (value < 0) throw new IllegalArgumentException("not MessagePack of a head: an integer beyond 64 bits with sign");
        return value;
    }

    /** Each element has a byte at least, so that a count beyond what is left is a lie. */
    private static int counted(ByteBuffer data, long count, int least) {
        if (count * least > data.remaining()) throw new BufferUnderflowException();
        return (int) count;
    }

    private static String readText(ByteBuffer data, long count) throws CharacterCodingException {
        ByteBuffer bytes = data.slice(data.position(), counted(data, count, 1));
        data.position(data.position() + bytes.remaining());
        return StandardCharsets.UTF_8.newDecoder().decode(bytes).toString();
    }

    private static List<Object> readList(ByteBuffer data, long count, int depth) throws CharacterCodingException {
        List<Object> items = new ArrayList<>(counted(data, count, 1));
        for (long i = 0; i < count; ++i) items.add(read(data, depth + 1));
        return items;
    }

    private static Map<String, Object> readMap(ByteBuffer data, long count, int depth) throws CharacterCodingException {
        Map<String, Object> members = new LinkedHashMap<>();
        counted(data, count, 2);
        for (long i = 0; i < count; ++i) {
            if (!(read(data, depth + 1) instanceof String name))
                throw new IllegalArgumentException("not MessagePack of a head: a key that is no string");
            members.put(name, read(data, depth + 1));
        }
        return members;
    }
}
