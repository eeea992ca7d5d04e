// SPDX-License-Identifier: Apache-2.0
// A chaser approaches a target and its arm unfolds: 100 frames with depth maps, a light spot on the target.
//
// The arm is a tree: each link hangs on the one before by a hinge, so that a frame only sets angles. Prints one line a frame
// and writes the last picture; the same pictures as clients/python/examples/rendezvous.py.
//
// Run: java -cp obscura-client.jar Rendezvous.java [FRAMES [FOLDER]]
import static obscura.client.Keys.keys;

import java.nio.FloatBuffer;
import java.nio.file.Files;
import java.nio.file.Path;
import java.security.MessageDigest;
import java.util.HexFormat;
import java.util.List;
import java.util.Locale;
import java.util.Map;
import obscura.client.Client;
import obscura.client.calls.Render;

class Rendezvous {
    public static void main(String[] arguments) throws Exception {
        int frames = arguments.length > 0 ? Integer.parseInt(arguments[0]) : 100;
        Path folder = Path.of(arguments.length > 1 ? arguments[1] : ".");
        MessageDigest digest = MessageDigest.getInstance("SHA-256");
        try (Client camera = Client.start()) {
            camera.load(scene());
            for (int frame = 0; frame < frames; ++frame) {
                double along = frame / (double) Math.max(frames - 1, 1);
                double far = 1 - 0.6 * along;
                camera.set("camera", keys("position_m", List.of(6.0 * far, -3.0 * far, -60.0 * far)));
                camera.set("lamp", "spot", keys("position_m", List.of(6.0 * far + 0.5, -3.0 * far, -60.0 * far)));
                camera.set("body", "upper arm", keys("joint_angle_deg", 70 * along));
                camera.set("body", "forearm", keys("joint_angle_deg", 40 * along));
                var picture = camera.render(new Render().timeS(frame).frame(frame + 1).samples(4).layers("depth_m").truth(true));
                digest.update(picture.arrays().get(picture.quantity()).bytes());
                System.out.printf(Locale.ROOT, "frame %3d: nearest surface %7.3f m, light %.4e W/m2%n", frame + 1,
                        nearest(picture.depthM()), sum(picture.values()));
                if (frame + 1 == frames) picture.save(folder.resolve("rendezvous.png"));
            }
            Files.writeString(folder.resolve("rendezvous.toml"), camera.export());
        }
        System.out.println("sha256 of all pictures: " + HexFormat.of().formatHex(digest.digest()));
    }

    static Map<String, Object> scene() {
        return keys(
                "sun", keys("direction", List.of(-0.6, -0.5, -1.0)),
                "camera", keys("width", 256, "height", 256, "focal_length_mm", 25, "pixel_pitch_um", 20, "aperture_mm", 10,
                        "look_at", "target"),
                "lamp", List.of(keys("name", "spot", "beam", "gaussian", "half_angle_deg", 2.0, "intensity_w_sr", List.of(5e5),
                        "look_at", "target")),
                "body", List.of(
                        keys("name", "target", "shape", "box", "size_m", List.of(3.0, 3.0, 4.0), "albedo", 0.3,
                                "spin_axis", List.of(0, 0, 1), "spin_rate_deg_per_s", 0.5),
                        link("upper arm", "target"),
                        link("forearm", "upper arm")));
    }

    /** A boom of 2 m, hinged at its parent's end. */
    static Map<String, Object> link(String name, String parent) {
        return keys("name", name, "shape", "cone", "bottom_radius_m", 0.08, "top_radius_m", 0.08, "height_m", 2.0,
                "albedo", 0.6, "parent", parent, "position_m", List.of(0.0, 0.0, 2.0), "joint", "hinge",
                "joint_axis", List.of(0, 1, 0), "joint_angle_deg", 0.0);
    }

    static float nearest(FloatBuffer depths) {
        float least = Float.POSITIVE_INFINITY;
        for (int i = 0; i < depths.limit(); ++i)
            if (depths.get(i) < least) least = depths.get(i);
        return least;
    }

    static double sum(FloatBuffer values) {
        double sum = 0;
        for (int i = 0; i < values.limit(); ++i) sum += values.get(i);
        return sum;
    }
}
