// SPDX-License-Identifier: Apache-2.0
package obscura.client;

import static obscura.client.Keys.keys;

import java.nio.ByteBuffer;
import java.nio.file.Path;
import java.time.Duration;
import java.util.ArrayList;
import java.util.Arrays;
import java.util.Collections;
import java.util.LinkedHashMap;
import java.util.List;
import java.util.Map;
import java.util.Objects;
import java.util.Random;
import obscura.client.calls.CameraGet;
import obscura.client.calls.CameraSet;
import obscura.client.calls.Frame;
import obscura.client.calls.Render;
import obscura.client.calls.SceneGet;
import obscura.client.calls.SceneLoad;

/**
 * The Java client beside a server, run by clients_test.py. Usage: ClientTest ADDRESS FOLDER LOCKED-ADDRESS CAMERA-ADDRESS
 * BROKEN-ADDRESS... The server at LOCKED-ADDRESS wants FOLDER/token; at CAMERA-ADDRESS is a daemon. Prints one line a check; exit status 1 if one failed.
 */
final class ClientTest {
    private static int failed;

    private static void check(String what, boolean good, Object detail) {
        System.out.println((good ? "ok - " : "NOT OK - ") + what + (good ? "" : ": " + detail));
        if (!good) ++failed;
    }

    private static void check(String what, boolean good) {
        check(what, good, "");
    }

    private static void checkNear(String what, double got, double wanted, double limit) {
        check(what, Math.abs(got - wanted) <= limit, got + ", wanted " + wanted);
    }

    /** `call` throws such an error with that text. Returns it. */
    private static <E extends Exception> E checkThrows(String what, Class<E> kind, String message, Runnable call) {
        try {
            call.run();
            check(what, false, "was not refused");
        } catch (RuntimeException error) {
            check(what, kind.isInstance(error) && error.getMessage().contains(message), error);
            if (kind.isInstance(error)) return kind.cast(error);
        }
        return null;
    }

    private static Object there(Object value) {
        return MessagePack.unpack(MessagePack.pack(value));
    }

    private static boolean isHead(byte[] bytes) {
        try {
            MessagePack.unpack(ByteBuffer.wrap(bytes));
            return true;
        } catch (IllegalArgumentException error) {
            return false;
        }
    }

    private static byte[] bytes(int... values) {
        byte[] bytes = new byte[values.length];
        for (int i = 0; i < values.length; ++i) bytes[i] = (byte) values[i];
        return bytes;
    }

    private static void testMessagePack() {
        List<Object> values = new ArrayList<>(Arrays.asList(null, true, false, 0L, 127L, 128L, -1L, -32L, -33L, Long.MAX_VALUE,
                Long.MIN_VALUE, 0.1, Double.POSITIVE_INFINITY, "", "ü".repeat(40), "x".repeat(70000), List.of(),
                Collections.nCopies(300, 5L), Map.of("a", Map.of("b", List.of(1L, Map.of("c", "d"))))));
        Map<String, Object> many = new LinkedHashMap<>();
        for (long i = 0; i < 300; ++i) many.put("key " + i, i);
        values.add(many);
        check("values come back", values.equals(there(values)), there(values));
        check("arrays and small numbers are taken", List.of(1.0, 2.0).equals(there(new double[] {1, 2}))
                && List.of("a").equals(there(new String[] {"a"})) && Objects.equals(there((short) 3), 3L));
        byte[] packed = new byte[MessagePack.pack(keys("name", "x".repeat(40), "list", List.of(1, 2.5, keys("a", null)))).limit()];
        MessagePack.pack(keys("name", "x".repeat(40), "list", List.of(1, 2.5, keys("a", null)))).get(packed);
        int refused = 0;
        for (int cut = 0; cut < packed.length; ++cut) refused += isHead(Arrays.copyOf(packed, cut)) ? 0 : 1;
        check("heads that are cut are refused", refused == packed.length && isHead(packed), refused);
        byte[] deep = new byte[100000];
        Arrays.fill(deep, (byte) 0x91);
        for (byte[] bad : List.of(Arrays.copyOf(packed, packed.length + 1), bytes(0xDD, 0xFF, 0xFF, 0xFF, 0xFF),
                bytes(0xDB, 0xFF, 0xFF, 0xFF, 0xFF), bytes(0xDF, 0xFF, 0xFF, 0xFF, 0xFF), deep, bytes(0xC1), bytes(0x81, 1, 2),
                bytes(0xA1, 0xFF), bytes(0xCF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF)))
            check("a head of " + bad.length + " bytes that begins with " + (bad[0] & 0xFF) + " is refused", !isHead(bad));
        Random dice = new Random(1);
        for (int i = 0; i < 20000; ++i) { // what is thrown besides IllegalArgumentException ends the test
            byte[] random = new byte[1 + dice.nextInt(24)];
            dice.nextBytes(random);
            isHead(random);
        }
        checkThrows("objects cannot be sent", IllegalArgumentException.class, "cannot be sent", () -> there(new Object()));
    }

    private static Map<String, Object> litBall() {
        return keys("quantity", "radiance", "sun", keys("irradiance_scale", 0.0),
                "camera", keys("psf_sigma_px", 0.0, "boresight", List.of(0, 0, 1), "up", List.of(0, -1, 0), "width", 65,
                        "height", 49, "pixel_pitch_um", 2.0, "focal_length_mm", 10),
                "lamp", List.of(keys("name", "lamp", "intensity_w_sr", List.of(100.0), "boresight", List.of(0, 0, 1), "up",
                        List.of(0, -1, 0))),
                "body", List.of(keys("name", "ball", "shape", "ellipsoid", "radii_m", List.of(1, 1, 1), "albedo", 0.8,
                        "position_m", List.of(0, 0, 10))));
    }

    private static void testPictures(Client camera, Path folder) throws Exception {
        check("the server says what it is", camera.server().server().equals("obscura")
                && (Long) camera.server().limits().get("clients") >= 1, camera.server());
        check("a scene of maps is loaded", camera.load(litBall()).equals(List.of("ball")));
        Picture picture = camera.render(new Render().samples(16).layers("depth_m", "normal.z").truth(true));
        checkNear("radiance at the centre of the ball", picture.value(0, 24, 32), 0.8 / Math.PI * 100 / 81, 1e-3);
        checkNear("its depth", picture.depthM().get(24 * 65 + 32), 9, 1e-5);
        checkNear("its normal", picture.layer("normal.z").get(24 * 65 + 32), -1, 1e-6);
        List<DataArray> arrays = List.copyOf(picture.arrays().values());
        check("arrays are views of one buffer",
                arrays.size() == 3 && arrays.stream().allMatch(each -> each.bytes().array() == arrays.get(0).bytes().array()), arrays);
        check("a picture tells what it is", picture.toString().contains("65 x 49 px, 1 bands, radiance up to 0.31"), picture);
        check("the truth has the ball", picture.truth().get("bodies").toString().contains("ball"), picture.truth());
        checkThrows("a layer that was not rendered", IllegalArgumentException.class, "no layer", () -> picture.layer("range_m"));
        picture.save(folder.resolve("java.png"));
        picture.save(folder.resolve("java-depth.png"), "depth_m");
    }

    private static void testScene(Client camera) {
        check("keys are read", camera.get("body", "ball").get("albedo").equals(0.8) && camera.get("camera").get("width").equals(65L)
                && camera.elements("body").get(0).get("name").equals("ball"));
        String before = camera.export();
        RequestException wrong = checkThrows("a value out of range", RequestException.class, "out of range",
                () -> camera.set("body", "ball", keys("albedo", 2.5, "position_m", List.of(1, 1, 1))));
        check("its code, field and what is allowed", wrong.code().equals("bad-scene") && wrong.field().equals("body[0].albedo")
                && wrong.allowed().equals("0 to 1") && !wrong.message().contains("\n"), wrong);
        checkThrows("a misspelt key", RequestException.class, "did you mean \"width\"?", () -> camera.set("camera", keys("widht", 3)));
        checkThrows("a misspelt field", RequestException.class, "did you mean \"samples\"?",
                () -> camera.call("render", keys("sample", 4)));
        checkThrows("what cannot be sent", IllegalArgumentException.class, "cannot be sent",
                () -> camera.set("camera", keys("width", new Object())));
        check("nothing was changed", camera.export().equals(before));
        camera.add("body", keys("name", "moon", "shape", "ellipsoid", "radii_m", List.of(1, 1, 1), "albedo", 0.1, "position_m",
                List.of(5, 0, 10), "spin_rate_deg_per_s", 1));
        camera.set("body", "moon", keys("spin_rate_deg_per_s", null));
        check("a key is removed", !camera.get("body", "moon").containsKey("spin_rate_deg_per_s"));
        check("elements go by number, too", camera.call(new SceneGet().section("body").item(1)).keys().toString().contains("moon"));
        camera.remove("body", "moon");
        check("a scene comes back from its text", camera.export().equals(before) && camera.loadToml(before).equals(List.of("ball"))
                && camera.export().equals(before));
        check("typed calls answer", camera.call(new SceneLoad().file("demo")).width() > 0 && camera.describe().calls().size() > 5
                && camera.status().waiting() == 0 && camera.status().call() == null);
    }

    private static void testSensor(Client camera) {
        Picture exposed = camera.render(new Render().exposureS(0.02)
                .sensor(keys("file", "generic", "readout", keys("width", 96, "height", 64))));
        check("a sensor gives digital numbers", exposed.quantity().equals("dn") && exposed.detector().get("bits").equals(12L)
                && exposed.digitalNumbers().remaining() == 96 * 64, exposed);
        float most = 0;
        for (int row = 0; row < 64; ++row) most = Math.max(most, exposed.value(0, row, 40));
        check("which are those of its bits", most > 0 && most < 4096, most);
        check("and can be looked at", exposed.preview().getWidth() == 96 && exposed.toString().contains("dn up to"), exposed);
        checkThrows("which are no light", IllegalStateException.class, "<u2", exposed::values);
    }

    private static void testCodecs(Client camera) {
        Render options = new Render().width(200).height(150).samples(2).layers("depth_m");
        Picture plain = camera.render(options);
        Picture packed = camera.render(options.codec("shuffle-lz4"));
        check("any call gives its arrays", camera.answer(options).arrays().stream().map(DataArray::name).toList()
                .equals(List.of("irradiance", "depth_m")));
        check("compressed pictures have the same bytes", plain.values().equals(packed.values())
                && plain.arrays().get("depth_m").bytes().equals(packed.arrays().get("depth_m").bytes()));
        for (byte[] bad : List.of(bytes(), bytes(0x10), bytes(0xF0, 0xFF), bytes(0x10, 1, 0, 0), bytes(0x10, 1, 2, 0),
                bytes(0x1F, 1, 1, 0, 0xFF, 0xFF, 0xFF, 0), bytes(0x40, 1, 2, 3, 4), bytes(0x90, 1, 2, 3, 4, 5, 6, 7, 8, 9)))
            checkThrows("a broken LZ4 block of " + bad.length + " bytes", IllegalArgumentException.class, "LZ4",
                    () -> Codecs.decode("shuffle-lz4", ByteBuffer.wrap(bad), 4, 8));
        // Literals 1 2, then 6 bytes from 2 before: 1 2 1 2 1 2 1 2, sorted by place.
        ByteBuffer overlapping = Codecs.decode("shuffle-lz4", ByteBuffer.wrap(bytes(0x22, 1, 2, 2, 0, 0x00)), 4, 8);
        byte[] found = new byte[8];
        overlapping.get(found);
        check("a match that overlaps", Arrays.equals(found, bytes(1, 1, 1, 1, 2, 2, 2, 2)), Arrays.toString(found));
        checkThrows("another codec", IllegalArgumentException.class, "codec", () -> Codecs.decode("x", ByteBuffer.allocate(8), 4, 8));
    }

    private static void testTokens(String locked, Path folder) {
        Duration patience = Duration.ofMinutes(2);
        checkThrows("a server that wants a token", RequestException.class, "token", () -> Client.connect(locked));
        checkThrows("a token that is none", IllegalArgumentException.class, "allowed 32",
                () -> Client.connect(locked, patience, folder.resolve("java.png")));
        checkThrows("a token that is missing", IllegalArgumentException.class, "cannot be read",
                () -> Client.connect(locked, patience, folder.resolve("none")));
        checkThrows("a wrong token", RequestException.class, "", () -> Client.connect(locked, patience, folder.resolve("wrong")));
        try (Client known = Client.connect(locked, patience, folder.resolve("token"))) {
            check("the token permits", known.server().permission().equals("scene") && known.status().waiting() == 0);
        }
    }

    private static void testCamera(String address) {
        try (Client live = Client.connect(address, Duration.ofMinutes(2))) {
            Map<String, Object> changed = live.call(new CameraSet().values(keys("ExposureTime", 5000))).changed();
            check("settings of a camera are changed", changed.get("ExposureTime").equals(5000.0)
                    && live.call(new CameraGet().names("ExposureTime")).values().get("ExposureTime").equals(5000.0), changed);
            DataArray pixels = live.answer(new Frame()).arrays().get(0);
            check("its frames are digital numbers", pixels.shorts().remaining() == pixels.shape().get(0) * pixels.shape().get(1), pixels);
            RequestException wrong = checkThrows("an unknown setting", RequestException.class, "Exposure",
                    () -> live.call(new CameraSet().values(keys("Exposure", 1))));
            check("its code", wrong.code().equals("bad-argument"), wrong.code());
        }
    }

    private static void testCancelling(Client camera) throws Exception {
        Render endless = new Render().width(2048).height(2048).samples(65536);
        long[] told = new long[2];
        checkThrows("what the listener throws cancels", IllegalStateException.class, "enough", () -> camera.render(endless,
                (done, total, left) -> {
                    told[0] = done;
                    told[1] = total;
                    throw new IllegalStateException("enough");
                }));
        check("progress is that of rows", told[0] >= 0 && told[0] < told[1] && told[1] == 2048, Arrays.toString(told));
        Thread self = Thread.currentThread();
        RequestException cancelled = checkThrows("an interrupt cancels", RequestException.class, "cancelled",
                () -> camera.render(endless, (done, total, left) -> self.interrupt()));
        check("the thread stays interrupted", Thread.interrupted() && cancelled.code().equals("cancelled"));
        check("the connection lives on", camera.status().waiting() == 0);
        camera.close();
        checkThrows("a closed client says so", ConnectionLostException.class, "closed", camera::status);
    }

    private static void testOwnServer(Path folder) {
        try (Client own = new PrivateServer().scene("demo").threads(1).root(folder).start()) {
            check("a server of the program's own renders",
                    own.render(new Render().width(32).height(32).samples(1)).values().remaining() == 32 * 32);
        }
        checkThrows("a program that is missing", ConnectionLostException.class, "none",
                () -> new PrivateServer().program(folder.resolve("none")).start());
        checkThrows("a program that is another", ConnectionLostException.class, "ended at its start",
                () -> new PrivateServer().program(Path.of("/bin/true")).start());
        checkThrows("a scene that is missing", RequestException.class, "nosuch", () -> Client.start("nosuch"));
    }

    public static void main(String[] arguments) throws Exception {
        Path folder = Path.of(arguments[1]);
        testMessagePack();
        try (Client camera = Client.connect(arguments[0], Duration.ofMinutes(2))) {
            testPictures(camera, folder);
            testScene(camera);
            testSensor(camera);
            testCodecs(camera);
            testCancelling(camera);
        }
        testTokens(arguments[2], folder);
        testCamera(arguments[3]);
        testOwnServer(folder);
        for (int i = 4; i < arguments.length; ++i) {
            String[] broken = arguments[i].split("=", 2);
            checkThrows("a broken server: " + broken[1], ConnectionLostException.class, broken[1],
                    () -> Client.connect(broken[0], Duration.ofMillis(300)));
        }
        for (String nowhere : List.of("nonsense", folder.resolve("nothing").toString(), "nohost.invalid:5152"))
            checkThrows("no server at " + nowhere, ConnectionLostException.class, "is `obscura serve` running there?",
                    () -> Client.connect(nowhere));
        System.out.println(failed + " checks failed");
        System.exit(failed == 0 ? 0 : 1);
    }
}
