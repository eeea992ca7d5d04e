// SPDX-License-Identifier: Apache-2.0
// The scenario of scenario_test.py in Java. Usage: java Scenario ADDRESS
import static obscura.client.Keys.keys;

import java.nio.ByteBuffer;
import java.nio.FloatBuffer;
import java.nio.ShortBuffer;
import java.nio.charset.StandardCharsets;
import java.security.MessageDigest;
import java.util.HexFormat;
import java.util.List;
import java.util.Map;
import obscura.client.Client;
import obscura.client.Picture;
import obscura.client.RequestException;
import obscura.client.calls.Render;

final class Scenario {
    private static String digest(ByteBuffer bytes) throws Exception {
        MessageDigest digest = MessageDigest.getInstance("SHA-256");
        digest.update(bytes);
        return HexFormat.of().formatHex(digest.digest());
    }

    private static void show(Picture picture) throws Exception {
        System.out.println("values " + digest(picture.arrays().get(picture.quantity()).bytes()));
        System.out.println("depth " + digest(picture.arrays().get("depth_m").bytes()));
        int lit = 0;
        for (FloatBuffer values = picture.values(); values.hasRemaining();) lit += values.get() > 0 ? 1 : 0;
        int seen = 0;
        for (FloatBuffer depths = picture.depthM(); depths.hasRemaining();) seen += Float.isNaN(depths.get()) ? 0 : 1;
        System.out.println("lit " + lit + "\nseen " + seen);
    }

    public static void main(String[] arguments) throws Exception {
        try (Client camera = Client.connect(arguments[0])) {
            camera.load(Map.of());
            camera.set("camera", keys("width", 160, "height", 120, "focal_length_mm", 10.0, "pixel_pitch_um", 20.0,
                    "boresight", List.of(0, 0, 1), "up", List.of(0, -1, 0), "psf_sigma_px", 1.5));
            camera.set("sun", keys("direction", List.of(-1.0, -0.5, -2.0)));
            camera.add("body", keys("name", "ball", "shape", "ellipsoid", "radii_m", List.of(1.0, 1.0, 1.0), "albedo", 0.3,
                    "position_m", new double[] {0.25, -0.125, 12.5}));
            show(camera.render(new Render().timeS(0).samples(16).seed(7).frame(3).layers("depth_m")));
            try {
                camera.set("body", "ball", keys("albedo", 2.5));
            } catch (RequestException error) {
                System.out.println("refused " + error.code() + " " + error.field() + " " + error.allowed());
            }
            camera.set("body", "ball", keys("position_m", List.of(0.1, 0.2, 10.0)));
            camera.set("camera", keys("psf_sigma_px", null));
            show(camera.render(new Render().timeS(1.5).samples(16).seed(7).frame(4).layers("depth_m")));
            Picture exposed = camera.render(new Render().exposureS(0.02)
                    .sensor(keys("file", "generic", "readout", keys("width", 96, "height", 64))).samples(2).seed(7).frame(5).run(3));
            long sum = 0;
            for (ShortBuffer numbers = exposed.digitalNumbers(); numbers.hasRemaining();)
                sum += Short.toUnsignedInt(numbers.get());
            System.out.println("dn " + digest(exposed.arrays().get("dn").bytes()) + "\nsum " + sum);
            System.out.println("export " + digest(StandardCharsets.UTF_8.encode(camera.export())));
        }
    }
}
