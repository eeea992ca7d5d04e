/* SPDX-License-Identifier: Apache-2.0 */
/* C client of the Obscura rendering server: connections, calls, pictures whose arrays are views of what was
 * received. */
/**
 * @file
 * C client of the Obscura rendering server (`obscura serve`).
 *
 *     obscura_error error;
 *     obscura_client* camera = obscura_start(&(obscura_start_options){.scene = "demo"}, &error);
 *     obscura_answer* picture = NULL;
 *     if (camera && obscura_render(camera, &(obscura_render_options){.samples = 16}, &picture) == OBSCURA_OK)
 *         printf("%g W/m2\n", obscura_array_find(picture, "irradiance")->floats[0]);
 *     obscura_answer_free(picture);
 *     obscura_close(camera);
 *
 * The library is C11 over POSIX sockets and needs nothing else. It neither prints nor exits, raises no signal
 * and keeps no global state. Different clients may be used by different threads at once; one client is for
 * one thread at a time, but obscura_cancel() is for any. Every wait has a limit. What a server sends is
 * checked: a hostile one can be refused service, not memory.
 *
 * Names, units and ranges of scene keys are those of scene files (docs/reference/scene.md, `obscura keys`),
 * names and fields of calls those of docs/reference/calls.md.
 *
 * Ownership: an obscura_value that is given to a function belongs to that function from then on, whatever it
 * returns. What a function returns as `const` lives as long as what it was asked of.
 */
#ifndef OBSCURA_CLIENT_H
#define OBSCURA_CLIENT_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#if defined(__GNUC__)
#define OBSCURA_API __attribute__((visibility("default")))
#define OBSCURA_ENDS_WITH_NULL __attribute__((sentinel))
#else
#define OBSCURA_API
#define OBSCURA_ENDS_WITH_NULL
#endif

/** Version of this interface. A larger minor number adds to it, a larger major number breaks it. */
#define OBSCURA_CLIENT_VERSION_MAJOR 1
#define OBSCURA_CLIENT_VERSION_MINOR 2

/** A connection and its scene. */
typedef struct obscura_client obscura_client;
/** nil, boolean, integer, number, string, array or map. */
typedef struct obscura_value obscura_value;
/** Answer of a call: a map and arrays. A picture is the answer of `render`. */
typedef struct obscura_answer obscura_answer;

/** Outcome of a call. */
typedef enum obscura_status {
    OBSCURA_OK = 0,
    OBSCURA_PENDING = 1,   /**< obscura_wait() only: no answer yet */
    OBSCURA_REFUSED = 2,   /**< the server refused the request; connection and scene are as they were */
    OBSCURA_CANCELLED = 3, /**< the request was cancelled; connection and scene are as they were */
    OBSCURA_LOST = 4,      /**< the connection is gone, and with it the scene */
    OBSCURA_BAD_USE =
        5 /**< nothing was sent: an argument is wrong, a value cannot be sent, or memory is short */
} obscura_status;

/** What went wrong. All texts are UTF-8 and end with 0; those that are not known are empty, long ones are
 * cut. */
typedef struct obscura_error {
    obscura_status status;
    char code[64];      /**< word: "bad-argument", "bad-scene", "cancelled", "connection-lost", ... */
    char message[1024]; /**< one line for people */
    char field[256];    /**< what of the request or scene is wrong */
    char allowed[1024]; /**< values that it may have */
    char hint[512];     /**< what to try */
} obscura_error;

/* Connections */

/** How obscura_connect() does it. Members that are 0 have their default. */
typedef struct obscura_connect_options {
    double timeout_s;        /**< longest silence of the server; 600 */
    uint64_t max_body_bytes; /**< largest arrays of one answer; 2^36 */
    const char* token_file; /**< file of the token that the server wants (obscura serve --make-token); none */
    double connect_timeout_s; /**< longest wait for the connection and the server's greeting; timeout_s */
    uint64_t reserved[4];     /**< 0 */
} obscura_connect_options;

/** What obscura_start() starts. Members that are 0 have their default. */
typedef struct obscura_start_options {
    const char* scene;    /**< shipped scene ("demo"), or a file below `root`, to begin with; none */
    const char* root;     /**< folder below which scenes may name files; the working directory */
    const char* program;  /**< program `obscura`; that of the environment variable OBSCURA, else of PATH */
    int threads;          /**< render threads; one per core */
    double timeout_s;     /**< as in obscura_connect_options */
    uint64_t reserved[6]; /**< 0 */
} obscura_start_options;

/**
 * Client of a server that runs: "HOST:PORT" such as "127.0.0.1:5152", or the path of its Unix socket, which
 * has a "/".
 * Without `options` the defaults hold. Returns NULL on failure, and why in `error` if that is not NULL.
 */
OBSCURA_API obscura_client* obscura_connect(const char* address, const obscura_connect_options* options,
                                            obscura_error* error);

/**
 * Starts a server of this program's own and connects to it. The server ends with the client, or with this
 * program; it is out of reach of others and of the terminal's Ctrl-C. Parameters and result as of
 * obscura_connect().
 */
OBSCURA_API obscura_client* obscura_start(const obscura_start_options* options, obscura_error* error);

/** Ends the connection and, after obscura_start(), the server. Answers stay valid. NULL is ignored. */
OBSCURA_API void obscura_close(obscura_client* client);

/** Outcome of the last call that this client made; `status` is OBSCURA_OK if that was well. */
OBSCURA_API const obscura_error* obscura_last_error(const obscura_client* client);

/** What the server said of itself at the start: version, permission, limits, ... (call `hello`). */
OBSCURA_API const obscura_value* obscura_server(const obscura_client* client);

/** Socket for poll() beside obscura_begin() and obscura_wait(); -1 after the connection was lost. Not for
 * reading. */
OBSCURA_API int obscura_socket(const obscura_client* client);

/* Calls */

/**
 * News of a call that takes long, at most five a second. A result other than 0 cancels the call. `left_s` is
 * NAN before it is known. Called by the thread that waits; it may not use the client.
 */
typedef int (*obscura_progress)(void* context, int64_t done, int64_t total, double left_s);

/** Function that hears of the progress of all further calls; NULL: none. */
OBSCURA_API void obscura_set_progress(obscura_client* client, obscura_progress progress, void* context);

/**
 * Makes any call of the server and waits for its answer. `fields` is the map of the call's fields; NULL:
 * none.
 * `*answer` receives the answer, which is to be freed, or NULL on failure; `answer` may be NULL.
 */
OBSCURA_API obscura_status obscura_call(obscura_client* client, const char* name, obscura_value* fields,
                                        obscura_answer** answer);

/**
 * Sends a request, without waiting for the answer, which obscura_wait() gets. A request that is in progress
 * already is cancelled and its answer thrown away.
 */
OBSCURA_API obscura_status obscura_begin(obscura_client* client, const char* name, obscura_value* fields);

/**
 * Answer of the request in progress, which `*answer` receives as that of obscura_call(). The longest wait is
 * `wait_s`; 0: only look; below 0: until the server has been silent for the client's timeout.
 * OBSCURA_PENDING: it is not there yet, and can be waited for again.
 */
OBSCURA_API obscura_status obscura_wait(obscura_client* client, double wait_s, obscura_answer** answer);

/**
 * Next frame of the stream in progress, which obscura_begin() has opened, such as "stream" of a camera's
 * daemon: `*frame` receives it as an answer, which is to be freed. Each but the first grants the server one
 * more frame (call `credit`), beside the "credits" of the request. The longest wait is as of obscura_wait().
 * OBSCURA_OK without a frame: the stream has ended as was asked for. It is left by obscura_cancel(), or by
 * the next request.
 */
OBSCURA_API obscura_status obscura_next(obscura_client* client, double wait_s, obscura_answer** frame);

/**
 * Cancels the request in progress, which then ends with OBSCURA_CANCELLED, or with its answer if that was on
 * the way. For any thread and for signal handlers, while the client is not being closed.
 */
OBSCURA_API void obscura_cancel(obscura_client* client);

/* Scene: calls with their fields as arguments. `item` is the name of an element of "body", "lamp", ...; else
 * NULL. */

/** Replaces the scene by a shipped one ("demo") or by a file below the server's folder. */
OBSCURA_API obscura_status obscura_load(obscura_client* client, const char* file);
/** Replaces the scene by the text of a scene file. */
OBSCURA_API obscura_status obscura_load_toml(obscura_client* client, const char* toml);
/** Replaces the scene by a map of tables. */
OBSCURA_API obscura_status obscura_load_scene(obscura_client* client, obscura_value* scene);
/** Changes keys of a table ("camera", "sun", ...) or of an element: all or none. nil removes a key. */
OBSCURA_API obscura_status obscura_set(obscura_client* client, const char* section, const char* item,
                                       obscura_value* keys);
/** Changes one key to a number. */
OBSCURA_API obscura_status obscura_set_number(obscura_client* client, const char* section, const char* item,
                                              const char* key, double value);
/** Changes one key to an array of numbers. */
OBSCURA_API obscura_status obscura_set_numbers(obscura_client* client, const char* section, const char* item,
                                               const char* key, const double* values, size_t count);
/** Changes one key to a string. */
OBSCURA_API obscura_status obscura_set_string(obscura_client* client, const char* section, const char* item,
                                              const char* key, const char* value);
/** Adds a body, a lamp, ... */
OBSCURA_API obscura_status obscura_add(obscura_client* client, const char* section, obscura_value* keys);
/** Removes a table or an element. */
OBSCURA_API obscura_status obscura_remove(obscura_client* client, const char* section, const char* item);
/** The keys that are given; `*keys` is to be freed with obscura_value_free(), NULL on failure. */
OBSCURA_API obscura_status obscura_get(obscura_client* client, const char* section, const char* item,
                                       obscura_value** keys);
/** The scene as a scene file; `*toml` is to be freed with free(), NULL on failure. */
OBSCURA_API obscura_status obscura_export(obscura_client* client, char** toml);

/* Pictures */

/** Fields of `render`. Members that are 0 are not sent, so that the server's default holds (also for seed 0:
 * use obscura_call()). */
typedef struct obscura_render_options {
    double time_s;     /**< scene time of mid-exposure */
    double exposure_s; /**< exposure time */
    int width, height; /**< size of the picture, with the same field of view; that of the scene */
    int window[4];     /**< column, row, width and height of the only part that is rendered; all */
    int samples;       /**< samples per pixel */
    double error;      /**< relative standard error of a pixel to sample to */
    int max_samples;   /**< with error */
    int bounces;       /**< reflections after the first */
    int64_t seed;      /**< of the random numbers */
    int64_t frame;     /**< number of the frame */
    int truth;         /**< other than 0: poses, as `truth` of the answer's map */
    const char*
        sensor; /**< shipped sensor, or a file below the server's folder, that exposes the picture; none */
    double gain_db;            /**< of a sensor */
    const char* const* layers; /**< names of further arrays ("depth_m", ...), behind the last NULL; none */
    uint64_t reserved[8];      /**< 0 */
} obscura_render_options;

/**
 * Renders the scene. The picture's first array, "irradiance" or "radiance", is float32 [bands, height, width]
 * with the first row on top; with a sensor it is "dn", uint16 [height, width]. The others are the layers,
 * float32 [height, width], NAN where nothing is.
 * Without `options` the defaults hold. `*picture` receives the picture, which is to be freed, or NULL on
 * failure.
 */
OBSCURA_API obscura_status obscura_render(obscura_client* client, const obscura_render_options* options,
                                          obscura_answer** picture);
/** Sends the request of obscura_render() without waiting for the picture, as obscura_begin(). */
OBSCURA_API obscura_status obscura_render_begin(obscura_client* client,
                                                const obscura_render_options* options);

/* Answers */

/** Array of an answer: a view that lives as long as the answer. C order. */
typedef struct obscura_array {
    const char* name;
    const char* dtype; /**< "<f4", "<u2", "|u1", ...: as numpy's, little-endian */
    size_t dimensions;
    size_t shape[8];
    size_t count; /**< elements */
    size_t bytes;
    const void* data;
    const float* floats; /**< the same if dtype is "<f4", else NULL */
} obscura_array;

/** The map of the answer. */
OBSCURA_API const obscura_value* obscura_answer_map(const obscura_answer* answer);
/** Number of its arrays. */
OBSCURA_API size_t obscura_array_count(const obscura_answer* answer);
/** Array by number; NULL: there is none. */
OBSCURA_API const obscura_array* obscura_array_at(const obscura_answer* answer, size_t number);
/** Array by name; NULL: there is none. */
OBSCURA_API const obscura_array* obscura_array_find(const obscura_answer* answer, const char* name);
/** Takes a file that a server handed over with its answer, over a Unix socket, such as the memory of the call
 * `ring`: the caller closes it. -1: there is no file of that number, or it has been taken. Since 1.2. */
OBSCURA_API int obscura_take_descriptor(obscura_answer* answer, size_t number);
/** Frees the answer with its map and arrays, and closes its files. NULL is ignored. */
OBSCURA_API void obscura_answer_free(obscura_answer* answer);

/* Values: makers. Where memory is short they return NULL, which makes a map or array that it is put into
 * unfit to be sent. */

OBSCURA_API obscura_value* obscura_nil(void);
OBSCURA_API obscura_value* obscura_bool(int value);
OBSCURA_API obscura_value* obscura_int(int64_t value);
OBSCURA_API obscura_value* obscura_number(double value);
/** UTF-8 that ends with 0. */
OBSCURA_API obscura_value* obscura_string(const char* text);
/** UTF-8 of that many bytes. */
OBSCURA_API obscura_value* obscura_text(const char* text, size_t bytes);
/** Empty array. */
OBSCURA_API obscura_value* obscura_array_new(void);
/** Array of numbers. */
OBSCURA_API obscura_value* obscura_numbers(const double* values, size_t count);
/** Array of three numbers. */
OBSCURA_API obscura_value* obscura_vector(double x, double y, double z);
/** Array of strings; NULL stands behind the last. */
OBSCURA_API obscura_value* obscura_strings(const char* const* texts);
/** Empty map. */
OBSCURA_API obscura_value* obscura_map_new(void);
/** Map of names and values in turn, with NULL behind the last: obscura_map("albedo", obscura_number(0.3),
 * NULL). */
OBSCURA_API obscura_value* obscura_map(const char* name, ...) OBSCURA_ENDS_WITH_NULL;
/** Puts an element at the end of an array. */
OBSCURA_API void obscura_append(obscura_value* array, obscura_value* element);
/** Puts a member into a map, instead of one that has the same name. */
OBSCURA_API void obscura_put(obscura_value* map, const char* name, obscura_value* value);
/** Copy of a value and all in it. */
OBSCURA_API obscura_value* obscura_value_copy(const obscura_value* value);
/** Frees a value that was given to nothing. NULL is ignored. */
OBSCURA_API void obscura_value_free(obscura_value* value);

/* Values: readers. NULL may be asked too, and is nil: a path of look-ups needs one check at its end. */

/** Kind of a value. */
typedef enum obscura_type {
    OBSCURA_NIL,
    OBSCURA_BOOL,
    OBSCURA_INT,
    OBSCURA_NUMBER,
    OBSCURA_STRING,
    OBSCURA_ARRAY,
    OBSCURA_MAP
} obscura_type;

OBSCURA_API obscura_type obscura_type_of(const obscura_value* value);
/** 1 for true, else 0. */
OBSCURA_API int obscura_as_bool(const obscura_value* value);
/** The integer; `otherwise` if it is none. */
OBSCURA_API int64_t obscura_as_int(const obscura_value* value, int64_t otherwise);
/** The number or integer; `otherwise` if it is none. */
OBSCURA_API double obscura_as_number(const obscura_value* value, double otherwise);
/** The string, with a 0 behind it; NULL if it is none. */
OBSCURA_API const char* obscura_as_string(const obscura_value* value);
/** Elements of an array, members of a map, bytes of a string; else 0. */
OBSCURA_API size_t obscura_count(const obscura_value* value);
/** Element of an array, or value of a member of a map, by number; NULL if there is none. */
OBSCURA_API const obscura_value* obscura_at(const obscura_value* value, size_t number);
/** Name of a member of a map by number; NULL if there is none. */
OBSCURA_API const char* obscura_name_at(const obscura_value* map, size_t number);
/** Member of a map by name; NULL if there is none. */
OBSCURA_API const obscura_value* obscura_find(const obscura_value* map, const char* name);

#ifdef __cplusplus
}
#endif

#endif
