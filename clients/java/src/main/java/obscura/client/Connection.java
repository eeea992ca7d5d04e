// SPDX-License-Identifier: Apache-2.0
package obscura.client;

import java.io.IOException;
import java.net.InetSocketAddress;
import java.net.SocketAddress;
import java.net.StandardProtocolFamily;
import java.net.StandardSocketOptions;
import java.net.UnixDomainSocketAddress;
import java.nio.ByteBuffer;
import java.nio.ByteOrder;
import java.nio.channels.SelectionKey;
import java.nio.channels.Selector;
import java.nio.channels.SocketChannel;
import java.nio.charset.StandardCharsets;
import java.time.Duration;
import java.util.Arrays;
import java.util.LinkedHashMap;
import java.util.List;
import java.util.Map;

/**
 * Native protocol: messages of a frame of 24 bytes, a MessagePack head and raw arrays. Requests one after the other, not for
 * several threads. The socket does not block: each wait has a limit, and an interrupt of the thread cancels the request
 * instead of closing the connection.
 */
final class Connection implements AutoCloseable {
    private static final int FRAME_BYTES = 24;
    private static final int VERSION = 1;
    private static final int REQUEST = 1;
    private static final int ANSWER = 2;
    private static final int EVENT = 3;
    private static final int ERROR = 4;
    private static final byte[] MAGIC = "OBSC".getBytes(StandardCharsets.US_ASCII);
    private static final int MOST_HEAD_BYTES = 64 << 20;

    private final String address;
    private final long timeoutNanos;
    private final Selector selector;
    private final SocketChannel channel;
    private final SelectionKey key;
    private final boolean isLocal;
    /** Bytes that have arrived and are not used: position to limit. */
    private final ByteBuffer input = ByteBuffer.allocateDirect(1 << 16).order(ByteOrder.LITTLE_ENDIAN).limit(0);

    private ByteBuffer output = ByteBuffer.allocateDirect(4096).order(ByteOrder.LITTLE_ENDIAN);
    private long next = 1;
    /** Number of the request in progress; 0: none. */
    private int current;
    private boolean interrupted;
    private boolean cancelSent;
    /** No message has been read in part. */
    private boolean whole = true;

    private record Message(int kind, int id, Map<String, Object> head, ByteBuffer body) {}

    /** Connects; `address`: "HOST:PORT", or the path of a Unix socket, which has a "/". */
    Connection(String address, Duration timeout) {
        this.address = address;
        timeoutNanos = timeout.toNanos();
        SocketChannel opened = null;
        Selector waiting = null;
        try {
            SocketAddress place = place(address);
            boolean isUnix = place instanceof UnixDomainSocketAddress;
            isLocal = isUnix || isLoopback((InetSocketAddress) place);
            opened = isUnix ? SocketChannel.open(StandardProtocolFamily.UNIX) : SocketChannel.open();
            if (!isUnix) opened.setOption(StandardSocketOptions.TCP_NODELAY, true);
            opened.configureBlocking(false);
            waiting = Selector.open();
            selector = waiting;
            channel = opened;
            key = channel.register(selector, 0);
            boolean connected = channel.connect(place);
            while (!connected) {
                await(SelectionKey.OP_CONNECT);
                connected = channel.finishConnect();
            }
        } catch (IOException | IllegalArgumentException error) {
            closeQuietly(opened);
            closeQuietly(waiting);
            throw new ConnectionLostException(address + ": " + reason(error) + " (is `obscura serve` running there?)");
        }
    }

    String address() {
        return address;
    }

    /** Whether the server is on this machine. */
    boolean isLocal() {
        return isLocal;
    }

    boolean isOpen() {
        return channel.isOpen();
    }

    @Override
    public void close() {
        closeQuietly(channel);
        closeQuietly(selector);
    }

    /**
     * Answer of a request. An interrupt of the thread cancels it, which is then answered with the error "cancelled"; the
     * thread stays interrupted.
     */
    Answer request(String call, Map<String, ?> fields, ProgressListener listener) {
        int number = send(call, fields);
        current = number;
        try {
            return receive(number, listener);
        } catch (ObscuraException error) {
            throw error;
        } catch (RuntimeException | Error error) { // of the listener, or memory is short
            if (!whole) close();
            if (isOpen()) giveUp(number);
            throw error;
        } finally {
            current = 0;
            if (interrupted) Thread.currentThread().interrupt();
            interrupted = false;
            cancelSent = false;
        }
    }

    private void giveUp(int number) {
        try {
            send("cancel", Map.of("request", number));
            receive(number, null);
        } catch (RequestException cancelled) {
            // as was asked for
        }
    }

    /** Sends a request; returns its number. */
    int send(String call, Map<String, ?> fields) {
        if (!isOpen()) throw lost("the connection is closed");
        Map<String, Object> members = new LinkedHashMap<>();
        members.put("call", call);
        members.putAll(fields);
        ByteBuffer head = MessagePack.pack(members);
        int number = (int) next;
        next = next % 0xFFFFFFFFL + 1;
        int bytes = FRAME_BYTES + head.remaining();
        if (output.capacity() < bytes) output = ByteBuffer.allocateDirect(bytes).order(ByteOrder.LITTLE_ENDIAN);
        output.clear().put(MAGIC).put((byte) VERSION).put((byte) REQUEST).putShort((short) 0).putInt(number);
        output.putInt(head.remaining()).putLong(0).put(head).flip();
        try {
            while (output.hasRemaining()) {
                if (channel.write(output) == 0) await(SelectionKey.OP_WRITE);
            }
        } catch (IOException error) {
            // There may be an error message to be read.
        }
        return number;
    }

    private Answer receive(int number, ProgressListener listener) {
        while (true) {
            Message message;
            try {
                message = read();
            } catch (IOException error) {
                close();
                throw lost(reason(error));
            }
            if (message.kind == ERROR && (message.id == number || message.id == 0)) {
                if (message.id == 0) close(); // of the connection as a whole
                throw new RequestException(message.head);
            }
            if (message.id != number) continue; // of a request that was given up
            if (message.kind == EVENT && listener != null && "progress".equals(message.head.get("event")))
                tell(listener, message.head);
            if (message.kind == ANSWER) return answer(message);
        }
    }

    private Answer answer(Message message) {
        try {
            List<DataArray> arrays = DataArray.of(message.head.remove("arrays"), message.body);
            return new Answer(message.head, arrays);
        } catch (IllegalArgumentException | ArithmeticException | ClassCastException | NullPointerException error) {
            close();
            throw lost("a message that is no answer: " + error.getMessage());
        }
    }

    private static void tell(ProgressListener listener, Map<String, Object> head) {
        double left = head.get("left_s") instanceof Number seconds ? seconds.doubleValue() : Double.NaN;
        listener.progress(((Number) head.get("done")).longValue(), ((Number) head.get("total")).longValue(), left);
    }

    private Message read() throws IOException {
        ByteBuffer frame = ByteBuffer.allocate(FRAME_BYTES).order(ByteOrder.LITTLE_ENDIAN);
        fill(frame);
        whole = false;
        byte[] magic = new byte[MAGIC.length];
        frame.get(magic);
        int version = frame.get();
        int kind = frame.get();
        frame.getShort(); // flags
        int id = frame.getInt();
        long headBytes = frame.getInt() & 0xFFFFFFFFL;
        long bodyBytes = frame.getLong();
        if (!Arrays.equals(magic, MAGIC) || version != VERSION)
            throw new IOException("the server does not speak this protocol");
        if (headBytes > MOST_HEAD_BYTES || bodyBytes < 0 || bodyBytes > Integer.MAX_VALUE - 8)
            throw new IOException("a message of " + headBytes + " + " + bodyBytes + " bytes is too large");
        ByteBuffer head = fill(ByteBuffer.allocate((int) headBytes));
        // On the heap, whose pages the collector uses again: each new direct buffer costs a fault for each of its pages.
        ByteBuffer body = fill(ByteBuffer.allocate((int) bodyBytes));
        whole = true;
        try {
            if (MessagePack.unpack(head) instanceof Map<?, ?> members) {
                @SuppressWarnings("unchecked")
                Map<String, Object> named = (Map<String, Object>) members;
                return new Message(kind, id, named, body);
            }
            throw new IOException("a head that is no map");
        } catch (IllegalArgumentException error) {
            throw new IOException(error.getMessage());
        }
    }

    /** Fills the buffer and flips it. */
    private ByteBuffer fill(ByteBuffer target) throws IOException {
        while (true) {
            int ready = Math.min(input.remaining(), target.remaining());
            target.put(input.slice(input.position(), ready));
            input.position(input.position() + ready);
            if (!target.hasRemaining()) return target.flip();
            // Much goes where it belongs at once; little into the buffer, with what follows.
            if (target.remaining() > input.capacity()) {
                arrive(target);
            } else {
                input.clear();
                arrive(input);
                input.flip();
            }
        }
    }

    /** Reads some bytes. */
    private void arrive(ByteBuffer target) throws IOException {
        while (true) {
            int count = channel.read(target);
            if (count < 0) throw new IOException("the server has ended the connection");
            if (count > 0) return;
            await(SelectionKey.OP_READ);
        }
    }

    /** Waits until the channel is ready. Throws IOException if nothing happens in time. */
    private void await(int operation) throws IOException {
        long end = System.nanoTime() + timeoutNanos;
        while (true) {
            if (Thread.interrupted()) interrupted = true;
            if (operation == SelectionKey.OP_READ) cancelIfInterrupted();
            key.interestOps(operation);
            long left = end - System.nanoTime();
            if (left <= 0) throw new IOException("no answer in time");
            int ready = selector.select(left / 1_000_000 + 1);
            selector.selectedKeys().clear();
            if (ready > 0) return;
        }
    }

    private void cancelIfInterrupted() {
        if (!interrupted || cancelSent || current == 0) return;
        cancelSent = true;
        send("cancel", Map.of("request", current));
    }

    ConnectionLostException lost(String what) {
        return new ConnectionLostException(address + ": " + what);
    }

    private static SocketAddress place(String address) {
        if (address.contains("/")) return UnixDomainSocketAddress.of(address);
        int colon = address.lastIndexOf(':');
        if (colon < 0) throw new IllegalArgumentException("neither HOST:PORT nor the path of a socket");
        return new InetSocketAddress(address.substring(0, colon), Integer.parseInt(address.substring(colon + 1)));
    }

    private static boolean isLoopback(InetSocketAddress place) {
        return !place.isUnresolved() && place.getAddress().isLoopbackAddress();
    }

    private static String reason(Exception error) {
        return error.getMessage() == null ? error.getClass().getSimpleName() : error.getMessage();
    }

    private static void closeQuietly(AutoCloseable resource) {
        try {
            if (resource != null) resource.close();
        } catch (Exception error) {
            // nothing is lost
        }
    }
}
