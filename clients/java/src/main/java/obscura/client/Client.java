// SPDX-License-Identifier: Apache-2.0
package obscura.client;

import java.nio.file.Path;
import java.time.Duration;
import java.util.LinkedHashMap;
import java.util.List;
import java.util.Map;
import obscura.client.calls.Challenge;
import obscura.client.calls.Describe;
import obscura.client.calls.Hello;
import obscura.client.calls.Render;
import obscura.client.calls.SceneAdd;
import obscura.client.calls.SceneExport;
import obscura.client.calls.SceneGet;
import obscura.client.calls.SceneLoad;
import obscura.client.calls.SceneRemove;
import obscura.client.calls.SceneSet;
import obscura.client.calls.Status;

/**
 * A connection to a rendering server and its scene, which only this client sees.
 *
 * <p>Names and units of keys are those of scene files. Every wait for the server has a limit, by default ten minutes without
 * news. Interrupting the thread cancels the request in progress, and the connection lives on. Not for several threads at once.
 */
public final class Client implements AutoCloseable {
    /** Version of this package. */
    public static final String VERSION = "0.2.0";
    /** Where `obscura serve` listens by itself. */
    public static final String DEFAULT_ADDRESS = "127.0.0.1:5152";

    static final Duration DEFAULT_TIMEOUT = Duration.ofMinutes(10);

    private final Connection connection;
    private final Hello.Result server;
    private Runnable onClose = () -> {};

    Client(String address, Duration timeout, Token token) {
        connection = new Connection(address, timeout);
        try {
            Hello hello = new Hello().protocolMin(1).protocolMax(1).client("obscura.client " + VERSION + " (Java)");
            server = call(token == null ? hello : hello.proof(token.proof(call(new Challenge()).challenge())));
        } catch (RuntimeException | Error error) {
            connection.close();
            throw error;
        }
    }

    /** Client of the server at DEFAULT_ADDRESS. Throws ConnectionLostException. */
    public static Client connect() {
        return connect(DEFAULT_ADDRESS);
    }

    /** Client of a server that runs: "HOST:PORT", or the path of its Unix socket. Throws ConnectionLostException. */
    public static Client connect(String address) {
        return connect(address, DEFAULT_TIMEOUT);
    }

    /** Client of a server that runs, waiting at most `timeout` for news from it. Throws ConnectionLostException. */
    public static Client connect(String address, Duration timeout) {
        return new Client(address, timeout, null);
    }

    /** Client of a server that wants a token, which the file has. Throws IllegalArgumentException if it is none. */
    public static Client connect(String address, Duration timeout, Path token) {
        return new Client(address, timeout, new Token(token));
    }

    /** Starts a server of this program's own, which ends with the client. Throws ConnectionLostException. */
    public static Client start() {
        return new PrivateServer().start();
    }

    /**
     * Starts a server of this program's own with a shipped scene, or one of a file below the working directory. Throws
     * ConnectionLostException, RequestException.
     */
    public static Client start(String scene) {
        return new PrivateServer().scene(scene).start();
    }

    /** Ends the connection, and a server of the program's own; the scene is gone. */
    @Override
    public void close() {
        connection.close();
        Runnable last = onClose;
        onClose = () -> {};
        last.run();
    }

    void onClose(Runnable last) {
        onClose = last;
    }

    Connection connection() {
        return connection;
    }

    /** What the server said of itself: version, permission, limits. */
    public Hello.Result server() {
        return server;
    }

    @Override
    public String toString() {
        return "Client[" + (connection.isOpen() ? connection.address() : "closed") + ", server " + server.version() + "]";
    }

    // Scene

    /** Replaces the scene by a shipped one ("demo") or by a file below the server's folder; returns the names of the bodies. */
    public List<String> load(String file) {
        return call(new SceneLoad().file(file)).bodies();
    }

    /** Replaces the scene by the text of a scene file; returns the names of the bodies. */
    public List<String> loadToml(String text) {
        return call(new SceneLoad().toml(text)).bodies();
    }

    /** Replaces the scene by tables and keys of a scene file; returns the names of the bodies. */
    public List<String> load(Map<String, ?> scene) {
        return call(new SceneLoad().scene(scene)).bodies();
    }

    /** The scene as a scene file; `obscura render` makes the same picture of it. */
    public String export() {
        return call(new SceneExport()).toml();
    }

    /** Keys that a table gives: "camera", "sun", "stars"; "scene": those before the first table. */
    public Map<String, Object> get(String section) {
        return Call.map(call(new SceneGet().section(section)).keys());
    }

    /** Keys that an element of "body", "lamp", ... gives. */
    public Map<String, Object> get(String section, String name) {
        return Call.map(call(new SceneGet().section(section).item(name)).keys());
    }

    /** Keys that each element of "body", "lamp", ... gives. */
    public List<Map<String, Object>> elements(String section) {
        return Call.maps(call(new SceneGet().section(section)).keys());
    }

    /** Changes keys of a table, all of them or none; null removes a key. */
    public void set(String section, Map<String, ?> keys) {
        call(new SceneSet().section(section).keys(keys));
    }

    /** Changes keys of an element of "body", "lamp", ..., all of them or none; null removes a key. */
    public void set(String section, String name, Map<String, ?> keys) {
        call(new SceneSet().section(section).item(name).keys(keys));
    }

    /** Adds a body, a lamp, ... */
    public void add(String section, Map<String, ?> keys) {
        call(new SceneAdd().section(section).keys(keys));
    }

    /** Removes a table. */
    public void remove(String section) {
        call(new SceneRemove().section(section));
    }

    /** Removes a body, a lamp, ... */
    public void remove(String section, String name) {
        call(new SceneRemove().section(section).item(name));
    }

    // Pictures

    /** Renders the scene at time 0 with the server's defaults. */
    public Picture render() {
        return render(new Render());
    }

    /** Renders the scene. */
    public Picture render(Render options) {
        return render(options, null);
    }

    /** Renders the scene and tells `listener` of the progress, in rows. Pictures of servers elsewhere come compressed. */
    public Picture render(Render options, ProgressListener listener) {
        Map<String, Object> fields = new LinkedHashMap<>(options.fields());
        boolean isCompressed = !connection.isLocal() && server.codecs() != null && server.codecs().contains(Codecs.SHUFFLE_LZ4);
        if (isCompressed) fields.putIfAbsent("codec", Codecs.SHUFFLE_LZ4);
        Answer answer = connection.request(options.name(), fields, listener);
        if (answer.arrays().isEmpty()) throw connection.lost("a picture without pixels");
        return new Picture(options.read(answer.head()), answer.arrays());
    }

    // Server

    /** The table of calls, and the tables and keys of scenes. */
    public Describe.Result describe() {
        return call(new Describe());
    }

    /** What the server does for this connection. */
    public Status.Result status() {
        return call(new Status());
    }

    /** Any call of obscura.client.calls. */
    public <R> R call(Call<R> call) {
        return call.read(connection.request(call.name(), call.fields(), null).head());
    }

    /** Any call of obscura.client.calls, answered with its arrays. */
    public Answer answer(Call<?> call) {
        return connection.request(call.name(), call.fields(), null);
    }

    /** Any call by its name, answered with its arrays. */
    public Answer call(String name, Map<String, ?> fields) {
        return connection.request(name, new LinkedHashMap<>(fields), null);
    }
}
