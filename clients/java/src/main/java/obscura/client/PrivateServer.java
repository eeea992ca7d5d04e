// SPDX-License-Identifier: Apache-2.0
package obscura.client;

import java.io.BufferedReader;
import java.io.File;
import java.io.IOException;
import java.nio.file.Files;
import java.nio.file.Path;
import java.time.Duration;
import java.util.List;
import java.util.concurrent.CompletableFuture;
import java.util.concurrent.ExecutionException;
import java.util.concurrent.TimeUnit;
import java.util.concurrent.TimeoutException;

/**
 * A server of this program's own, `obscura serve`, with settings: {@code new PrivateServer().threads(2).start()}. It ends with
 * its client, or with this program.
 */
public final class PrivateServer {
    private Path program;
    private Path root = Path.of("");
    private String scene;
    private int threads;
    private Duration timeout = Client.DEFAULT_TIMEOUT;

    /** Program to start; by default that of the environment variable OBSCURA, else `obscura` of PATH. */
    public PrivateServer program(Path value) {
        program = value;
        return this;
    }

    /** Folder below which scenes may name files; by default the working directory. */
    public PrivateServer root(Path value) {
        root = value;
        return this;
    }

    /** Shipped scene, or scene file below the root, to begin with. */
    public PrivateServer scene(String value) {
        scene = value;
        return this;
    }

    /** Render threads; 0: one per core. */
    public PrivateServer threads(int value) {
        threads = value;
        return this;
    }

    /** Longest wait for news from the server. */
    public PrivateServer timeout(Duration value) {
        timeout = value;
        return this;
    }

    /** Starts the server and returns its client. Throws ConnectionLostException, and RequestException for the scene. */
    public Client start() {
        Running running = new Running(program == null ? findProgram() : program);
        try {
            running.expectAddress();
            Client client = new Client(running.socket(), timeout, null);
            client.onClose(running::stop);
            if (scene != null) client.load(scene);
            return client;
        } catch (RuntimeException | Error error) {
            running.stop();
            throw error;
        }
    }

    private static Path findProgram() {
        String named = System.getenv("OBSCURA");
        if (named != null && !named.isEmpty()) return Path.of(named);
        String folders = System.getenv("PATH");
        for (String folder : (folders == null ? "" : folders).split(File.pathSeparator)) {
            Path program = Path.of(folder, "obscura");
            if (Files.isExecutable(program) && !Files.isDirectory(program)) return program;
        }
        throw new ConnectionLostException(
                "the program obscura is not found: set the environment variable OBSCURA to its path");
    }

    private final class Running {
        private final Path program;
        private final Path folder;
        private final Process process;
        private final CompletableFuture<String> complaints;
        private final Thread atExit = new Thread(this::end);

        Running(Path program) {
            this.program = program;
            try {
                folder = Files.createTempDirectory("obscura-"); // of this user alone, and so is the socket in it
            } catch (IOException error) {
                throw new ConnectionLostException("no temporary folder: " + error.getMessage());
            }
            List<String> command = List.of(program.toString(), "serve", "--listen", "none", "--unix", socket(), "--root",
                    root.toAbsolutePath().toString(), "--threads", Integer.toString(threads), "--clients", "1", "--with-input");
            try {
                process = new ProcessBuilder(command).start();
            } catch (IOException error) {
                remove(folder);
                throw new ConnectionLostException(program + ": " + error.getMessage());
            }
            Runtime.getRuntime().addShutdownHook(atExit);
            complaints = inBackground(() -> new String(process.getErrorStream().readAllBytes()));
        }

        String socket() {
            return folder.resolve("socket").toString();
        }

        /** Waits until the server listens. */
        void expectAddress() {
            BufferedReader output = process.inputReader();
            String line = within(inBackground(output::readLine), timeout);
            if (line != null && line.startsWith("listening at ")) return;
            end();
            String why = within(complaints, timeout);
            throw new ConnectionLostException(why == null || why.isBlank() ? program + ": ended at its start" : why.strip());
        }

        void stop() {
            try {
                Runtime.getRuntime().removeShutdownHook(atExit);
            } catch (IllegalStateException ending) {
                return; // the hook does it
            }
            end();
        }

        /** Closes the server's input, upon which it ends; it is killed if it does not in time. */
        private void end() {
            try {
                process.outputWriter().close();
                if (!process.waitFor(10, TimeUnit.SECONDS)) process.destroyForcibly();
            } catch (IOException | InterruptedException error) {
                process.destroyForcibly();
                if (error instanceof InterruptedException) Thread.currentThread().interrupt();
            }
            remove(folder);
        }
    }

    private interface Source {
        String read() throws IOException;
    }

    /** What `source` gives, read by a thread that does not hold the program up; null if it fails. */
    private static CompletableFuture<String> inBackground(Source source) {
        CompletableFuture<String> result = new CompletableFuture<>();
        Thread reader = new Thread(() -> {
            try {
                result.complete(source.read());
            } catch (IOException error) {
                result.complete(null);
            }
        }, "obscura-server-output");
        reader.setDaemon(true);
        reader.start();
        return result;
    }

    private static String within(CompletableFuture<String> result, Duration timeout) {
        try {
            return result.get(timeout.toNanos(), TimeUnit.NANOSECONDS);
        } catch (TimeoutException | ExecutionException error) {
            return null;
        } catch (InterruptedException error) {
            Thread.currentThread().interrupt();
            return null;
        }
    }

    private static void remove(Path folder) {
        try {
            Files.deleteIfExists(folder.resolve("socket"));
            Files.deleteIfExists(folder);
        } catch (IOException error) {
            // It is in the folder of temporary files.
        }
    }
}
