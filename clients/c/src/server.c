/* SPDX-License-Identifier: Apache-2.0 */
/* A server of this program's own: `obscura serve` as a child. */
#define _GNU_SOURCE /* POSIX_SPAWN_SETSID, mkostemp() */
#include "client.h"
#include "transport.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

extern char** environ;

/** Time that a server has to end once its standard input has. */
static const double stop_timeout_s = 5;

/** Whether the process has ended, waiting for it until then. */
static int ended(pid_t process, double until_s) {
    for (;;) {
        const pid_t found = waitpid(process, NULL, WNOHANG);
        if (found == process || (found < 0 && errno != EINTR)) return 1;
        if (oc_now_s() >= until_s) return 0;
        nanosleep(&(struct timespec){.tv_nsec = 2000000}, NULL);
    }
}

void oc_server_end(oc_server* server, char* complaint, size_t bytes) {
    oc_close(&server->input);
    if (server->process != 0 && !ended(server->process, oc_now_s() + stop_timeout_s)) {
        kill(server->process, SIGTERM);
        if (!ended(server->process, oc_now_s() + stop_timeout_s)) {
            kill(server->process, SIGKILL);
            (void)ended(server->process, oc_now_s() + stop_timeout_s);
        }
    }
    server->process = 0;
    if (complaint != NULL && server->complaints >= 0) {
        const ssize_t got = pread(server->complaints, complaint, bytes - 1, 0);
        complaint[got > 0 ? got : 0] = 0;
        complaint[strcspn(complaint, "\n")] = 0;
    }
    oc_close(&server->complaints);
    if (server->folder[0] == 0) return;
    char path[sizeof server->folder + 8];
    snprintf(path, sizeof path, "%s/socket", server->folder);
    unlink(path);
    rmdir(server->folder);
    server->folder[0] = 0;
}

/** A folder of this user alone, and a file without a name in it. 0 with errno on failure. */
static int make_folder(oc_server* server) {
    const char* temporary = getenv("TMPDIR");
    const int bytes = snprintf(server->folder, sizeof server->folder, "%s/obscura-XXXXXX",
                               temporary == NULL || temporary[0] == 0 ? "/tmp" : temporary);
    if (bytes < 0 || (size_t)bytes >= sizeof server->folder || mkdtemp(server->folder) == NULL) {
        server->folder[0] = 0;
        return 0;
    }
    char path[sizeof server->folder + 16];
    snprintf(path, sizeof path, "%s/errors-XXXXXX", server->folder);
    server->complaints = mkostemp(path, O_CLOEXEC);
    if (server->complaints < 0) return 0;
    unlink(path);
    return 1;
}

/** Starts the program with these ends of pipes. Returns 0 or an error number. */
static int spawn(oc_server* server, const char* program, char* const* words, int input, int output) {
    posix_spawn_file_actions_t files;
    posix_spawnattr_t how;
    sigset_t none, standard;
    sigemptyset(&none);
    sigemptyset(&standard);
    sigaddset(&standard, SIGPIPE);
    sigaddset(&standard, SIGINT);
    sigaddset(&standard, SIGTERM);
    posix_spawn_file_actions_init(&files);
    posix_spawnattr_init(&how);
    int fault = posix_spawn_file_actions_adddup2(&files, input, STDIN_FILENO);
    if (fault == 0) fault = posix_spawn_file_actions_adddup2(&files, output, STDOUT_FILENO);
    if (fault == 0) fault = posix_spawn_file_actions_adddup2(&files, server->complaints, STDERR_FILENO);
    /* A session of its own: the terminal's Ctrl-C is for the client. */
    if (fault == 0)
        fault = posix_spawnattr_setflags(&how,
                                         POSIX_SPAWN_SETSID | POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
    if (fault == 0) fault = posix_spawnattr_setsigmask(&how, &none);
    if (fault == 0) fault = posix_spawnattr_setsigdefault(&how, &standard);
    if (fault == 0) fault = posix_spawnp(&server->process, program, &files, &how, words, environ);
    if (fault != 0) server->process = 0;
    posix_spawn_file_actions_destroy(&files);
    posix_spawnattr_destroy(&how);
    return fault;
}

/** Whether the server says in time that it listens. */
static int listens(int output, double until_s) {
    static const char expected[] = "listening at ";
    char line[512];
    size_t got = 0;
    while (got < sizeof line && memchr(line, '\n', got) == NULL) {
        if (oc_wait_for(output, POLLIN, -1, until_s) == 0) break;
        const ssize_t more = read(output, line + got, sizeof line - got);
        if (more < 0 && (errno == EINTR || errno == EAGAIN)) continue;
        if (more <= 0) break;
        got += (size_t)more;
    }
    return got > sizeof expected && memcmp(line, expected, sizeof expected - 1) == 0 &&
           memchr(line, '\n', got) != NULL;
}

/** Starts the server, which then listens at `folder`/socket. 0 with one line in `error`. */
static int start_server(oc_server* server, const char* program, const obscura_start_options* options,
                        double timeout_s, obscura_error* error) {
    int input[2] = {-1, -1}, output[2] = {-1, -1};
    char path[sizeof server->folder + 8], threads[16];
    int fault = make_folder(server) && oc_pipe(input) && oc_pipe(output) ? 0 : errno;
    /* The child's ends block. */
    if (fault == 0 && (oc_set_blocking(input[0]) == 0 || oc_set_blocking(output[1]) == 0)) fault = errno;
    if (fault == 0) {
        snprintf(path, sizeof path, "%s/socket", server->folder);
        snprintf(threads, sizeof threads, "%d", options->threads);
        const char* words[] = {
            program,        "serve", "--listen",  "none",
            "--unix",       path,    "--root",    options->root == NULL ? "." : options->root,
            "--threads",    threads, "--clients", "1",
            "--with-input", NULL};
        fault = spawn(server, program, (char* const*)words, input[0], output[1]);
    }
    oc_close(&input[0]);
    oc_close(&output[1]);
    server->input = input[1];
    const int well = fault == 0 && listens(output[0], oc_now_s() + timeout_s);
    oc_close(&output[0]);
    if (well) return 1;
    char complaint[512] = "";
    oc_server_end(server, complaint, sizeof complaint);
    if (fault != 0)
        oc_fail(error, OBSCURA_LOST, "connection-lost",
                fault == ENOENT
                    ? "%s: %s: set the environment variable OBSCURA to the path of the program obscura"
                    : "%s: %s",
                program, strerror(fault));
    else
        oc_fail(error, OBSCURA_LOST, "connection-lost", "%s",
                complaint[0] != 0 ? complaint : "the server ended at its start");
    return 0;
}

obscura_client* obscura_start(const obscura_start_options* options, obscura_error* error) {
    static const obscura_start_options defaults = {0};
    if (options == NULL) options = &defaults;
    const char* program = options->program != NULL ? options->program : getenv("OBSCURA");
    if (program == NULL || program[0] == 0) program = "obscura";
    const obscura_connect_options how = {.timeout_s = options->timeout_s};
    oc_server server = {.input = -1, .complaints = -1};
    if (!start_server(&server, program, options, how.timeout_s > 0 ? how.timeout_s : 600, error)) return NULL;
    char path[sizeof server.folder + 8];
    snprintf(path, sizeof path, "%s/socket", server.folder);
    obscura_client* client = obscura_connect(path, &how, error);
    if (client == NULL) {
        oc_server_end(&server, NULL, 0);
        return NULL;
    }
    client->server = server;
    if (options->scene == NULL || obscura_load(client, options->scene) == OBSCURA_OK) return client;
    if (error != NULL) *error = client->error;
    obscura_close(client);
    return NULL;
}
