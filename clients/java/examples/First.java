// SPDX-License-Identifier: Apache-2.0
// The first example of docs/clients.md: a ball comes nearer. Run: java -cp obscura-client.jar First.java
import static obscura.client.Keys.keys;

import java.nio.file.Files;
import java.nio.file.Path;
import java.util.List;
import obscura.client.Client;
import obscura.client.calls.Render;

class First {
    public static void main(String[] arguments) throws Exception {
        try (Client camera = Client.start()) {
            camera.set("camera", keys("width", 640, "height", 480, "focal_length_mm", 25, "boresight", List.of(0, 0, 1), "up", List.of(0, -1, 0)));
            camera.set("sun", keys("direction", List.of(-1, -1, -2)));
            camera.add("body", keys("name", "ball", "shape", "ellipsoid", "radii_m", List.of(1, 1, 1), "albedo", 0.3));
            for (int step = 0; step < 10; ++step) {
                camera.set("body", "ball", keys("position_m", List.of(0, 0, 40 - step)));
                var picture = camera.render(new Render().samples(16).layers("depth_m", "normal.x", "normal.y", "normal.z"));
                System.out.println(picture + " " + picture.depthM().get(240 * 640 + 320));
            }
            Files.writeString(Path.of("ball.toml"), camera.export()); // obscura render ball.toml: the same bytes
        }
    }
}
