// SPDX-License-Identifier: Apache-2.0
package obscura.client;

import java.awt.image.BufferedImage;
import java.io.IOException;
import java.nio.FloatBuffer;
import java.nio.ShortBuffer;
import java.nio.file.Files;
import java.nio.file.Path;
import java.util.Arrays;
import java.util.LinkedHashMap;
import java.util.List;
import java.util.Locale;
import java.util.Map;
import javax.imageio.ImageIO;
import obscura.client.calls.Render;

/**
 * A rendered picture. Arrays are views of the buffer that was received, first row on top; rows and columns count from 0.
 *
 * @param quantity "irradiance", "radiance" if the scene says so, or "dn" of a sensor
 * @param unit unit of the values: W/m2 per pixel at the entrance pupil, W m-2 sr-1, or DN
 * @param bands spectral bands
 * @param height rows
 * @param width columns
 * @param arrays values and layers as they were received
 * @param bandsNm first and last wavelength of each band
 * @param timeS scene time
 * @param seconds time that the server took
 * @param truth poses of camera and bodies, if they were asked for, else null
 * @param detector bits, window, exposure and flags of a sensor's readout, else null
 */
public record Picture(String quantity, String unit, int bands, int height, int width, Map<String, DataArray> arrays,
        List<Object> bandsNm, double timeS, double seconds, Map<String, Object> truth,
        Map<String, Object> detector) {

    Picture(Render.Result head, List<DataArray> received) {
        this(received.get(0).name(), head.unit(), extent(received, 2), extent(received, 1), extent(received, 0), byName(received),
                head.bandsNm(), head.timeS(), head.seconds(), head.truth(), head.detector());
    }

    /** Numbers along an axis of the first array, counted from the last; 1 if it has fewer. */
    private static int extent(List<DataArray> received, int fromLast) {
        List<Integer> shape = received.get(0).shape();
        return fromLast < shape.size() ? shape.get(shape.size() - 1 - fromLast) : 1;
    }

    private static Map<String, DataArray> byName(List<DataArray> received) {
        Map<String, DataArray> arrays = new LinkedHashMap<>();
        for (DataArray array : received) arrays.put(array.name(), array);
        return arrays;
    }

    /** The light: band after band, row after row. Throws IllegalStateException for a picture of a sensor. */
    public FloatBuffer values() {
        return arrays.get(quantity).floats();
    }

    /** Digital numbers of a sensor, row after row: unsigned. Throws IllegalStateException for other pictures. */
    public ShortBuffer digitalNumbers() {
        return arrays.get(quantity).shorts();
    }

    /** Light, or digital number, of a pixel. */
    public float value(int band, int row, int column) {
        return value((band * height + row) * width + column);
    }

    private float value(int place) {
        return detector == null ? values().get(place) : Short.toUnsignedInt(digitalNumbers().get(place));
    }

    /** A further array, row after row: "depth_m", "normal.x", ... Throws IllegalArgumentException if it was not rendered. */
    public FloatBuffer layer(String name) {
        DataArray array = arrays.get(name);
        if (array == null || name.equals(quantity))
            throw new IllegalArgumentException("no layer \"" + name + "\": ask for it with new Render().layers(...)");
        return array.floats();
    }

    /** Range along the boresight, NaN where nothing is; rendered with the layer "depth_m". */
    public FloatBuffer depthM() {
        return layer("depth_m");
    }

    /** 8 bits a pixel for looking at: from dark to the 99.9th percentile of the lit pixels; not for measurement. */
    public BufferedImage preview() {
        float[] mean = new float[width * height];
        for (int i = 0; i < bands * mean.length; ++i) mean[i % mean.length] += value(i) / bands;
        return stretched(mean, true);
    }

    /** 8 bits a pixel of a layer, from its least to its largest value. */
    public BufferedImage preview(String layer) {
        float[] values = new float[width * height];
        layer(layer).get(values);
        return stretched(values, false);
    }

    /** Writes a PNG for looking at. */
    public Path save(Path file) throws IOException {
        return write(preview(), file);
    }

    /** Writes a layer as a PNG for looking at. */
    public Path save(Path file, String layer) throws IOException {
        return write(preview(layer), file);
    }

    private static Path write(BufferedImage image, Path file) throws IOException {
        try (var out = Files.newOutputStream(file)) {
            ImageIO.setUseCache(false);
            ImageIO.write(image, "png", out);
        }
        return file;
    }

    private BufferedImage stretched(float[] values, boolean fromDark) {
        BufferedImage image = new BufferedImage(width, height, BufferedImage.TYPE_BYTE_GRAY);
        float[] seen = new float[values.length];
        int count = 0;
        for (float value : values)
            if (Float.isFinite(value) && value != 0) seen[count++] = value;
        if (count == 0) return image;
        Arrays.sort(seen, 0, count);
        double low = fromDark ? 0 : seen[0];
        double high = fromDark ? seen[(int) Math.ceil(0.999 * (count - 1))] : seen[count - 1];
        int[] row = new int[width];
        for (int y = 0; y < height; ++y) {
            for (int x = 0; x < width; ++x) {
                float value = values[y * width + x];
                double part = Float.isNaN(value) ? 0 : (value - low) / Math.max(high - low, 1e-300);
                row[x] = (int) Math.rint(255 * Math.pow(Math.min(Math.max(part, 0), 1), 1 / 2.2));
            }
            image.getRaster().setPixels(0, y, width, 1, row);
        }
        return image;
    }

    @Override
    public String toString() {
        float most = 0;
        for (int i = 0; i < bands * height * width; ++i) most = Math.max(most, value(i));
        return String.format(Locale.ROOT, "Picture[%d x %d px, %d bands, %s up to %.4g %s, at %s s, arrays %s]", width, height,
                bands, quantity, most, unit, timeS, String.join(", ", arrays.keySet()));
    }
}
