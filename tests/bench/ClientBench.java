// SPDX-License-Identifier: Apache-2.0
// What calls of the rendering server cost its Java client, beside bare sockets; run by clients_bench.py.
// Usage: java -cp obscura-client.jar ClientBench.java SERVER ECHO-SERVER REPEATS
import static obscura.client.Keys.keys;

import java.io.IOException;
import java.net.InetSocketAddress;
import java.net.SocketAddress;
import java.net.StandardSocketOptions;
import java.net.UnixDomainSocketAddress;
import java.nio.ByteBuffer;
import java.nio.channels.SocketChannel;
import java.util.Arrays;
import java.util.Locale;
import java.util.Map;
import java.util.function.IntConsumer;
import obscura.client.Client;
import obscura.client.calls.Render;

class ClientBench {
    private static void show(String what, int count, IntConsumer work) {
        double[] spent = new double[count];
        for (int i = 0; i < count; ++i) { // those before the compiler has seen them are not counted
            work.accept(i);
        }
        for (int i = 0; i < count; ++i) {
            long begin = System.nanoTime();
            work.accept(i);
            spent[i] = 1e-3 * (System.nanoTime() - begin);
        }
        Arrays.sort(spent);
        System.out.printf(Locale.ROOT, "    %-26s p50 %9.0f us, p99 %9.0f us%n", what, spent[count / 2], spent[count * 99 / 100]);
    }

    private static SocketAddress place(String address) {
        if (address.contains("/")) return UnixDomainSocketAddress.of(address);
        int colon = address.lastIndexOf(':');
        return new InetSocketAddress(address.substring(0, colon), Integer.parseInt(address.substring(colon + 1)));
    }

    private static void ask(SocketChannel channel, int first, ByteBuffer answer) {
        try {
            channel.write(ByteBuffer.allocate(64).put(0, (byte) first));
            answer.clear();
            while (answer.hasRemaining() && channel.read(answer) >= 0) {
            }
        } catch (IOException error) {
            throw new IllegalStateException(error);
        }
    }

    public static void main(String[] arguments) throws Exception {
        int repeats = Integer.parseInt(arguments[2]);
        int few = Math.max(repeats / 20, 10);
        try (SocketChannel channel = SocketChannel.open(place(arguments[1]))) {
            if (!arguments[1].contains("/")) channel.setOption(StandardSocketOptions.TCP_NODELAY, true);
            ByteBuffer small = ByteBuffer.allocateDirect(64);
            ByteBuffer large = ByteBuffer.allocateDirect(4 << 20);
            show("bare sockets, 64 bytes", repeats, i -> ask(channel, 0, small));
            show("bare sockets, 4 MiB", few, i -> ask(channel, 1, large));
        }
        try (Client camera = Client.connect(arguments[0])) {
            show("status", repeats, i -> camera.status());
            show("set of a key of the Sun", repeats, i -> camera.set("sun", keys("limb_darkening", i / (double) repeats)));
            camera.load(Map.of());
            Render empty = new Render().width(1024).height(1024).samples(1);
            show("empty picture, 4 MiB", few, i -> camera.render(empty));
        }
    }
}
