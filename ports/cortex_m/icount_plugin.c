/* QEMU TCG plugin: counts the instructions executed between two marker functions.
 *
 *   -plugin libicount.so,begin=ADDRESS,end=ADDRESS,out=FILE[,profile=FILE]
 *
 * ADDRESS is a marker's first instruction (hexadecimal, without the Thumb bit). Each interval adds
 * one line to FILE: the number of instructions between the first instruction of marker `begin` and
 * the first instruction of marker `end`, without these two. The plugin counts instructions, not
 * cycles, because QEMU does not model pipeline, cache and flash wait states.
 *
 * With `profile`, each interval adds lines "ADDRESS EXECUTED TAKEN" to that file, one for each
 * executed address (hexadecimal), and then an empty line. TAKEN is how often the next instruction
 * was not the one behind it. tests/firmware/cycles.py reads this file.
 *
 * Debian ships QEMU with plugins but without qemu-plugin.h. So the used part of its API (version 1,
 * QEMU 4.2 to 8.x) is declared here. */
#include <inttypes.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef uint64_t qemu_plugin_id_t;
typedef struct qemu_info_t qemu_info_t;
struct qemu_plugin_tb;
struct qemu_plugin_insn;
enum { QEMU_PLUGIN_CB_NO_REGS = 0 };
typedef void (*tb_translated_t)(qemu_plugin_id_t id, struct qemu_plugin_tb *tb);
typedef void (*insn_executed_t)(unsigned int vcpu, void *userdata);

void qemu_plugin_register_vcpu_tb_trans_cb(qemu_plugin_id_t id, tb_translated_t callback);
void qemu_plugin_register_vcpu_insn_exec_cb(struct qemu_plugin_insn *insn, insn_executed_t callback,
                                            int flags, void *userdata);
size_t qemu_plugin_insn_size(const struct qemu_plugin_insn *insn);
size_t qemu_plugin_tb_n_insns(const struct qemu_plugin_tb *tb);
struct qemu_plugin_insn *qemu_plugin_tb_get_insn(const struct qemu_plugin_tb *tb, size_t i_insn);
uint64_t qemu_plugin_insn_vaddr(const struct qemu_plugin_insn *insn);

#define EXPORT __attribute__((visibility("default")))
EXPORT int qemu_plugin_version = 1;
EXPORT int qemu_plugin_install(qemu_plugin_id_t id, const qemu_info_t *info, int argc, char **argv);

/* Code lies below this address. Instructions are multiples of 2 bytes. */
#define CODE_BYTES_MAX (UINT32_C(1) << 20)

typedef struct {
    uint64_t n_executed, n_taken;
    uint32_t n_bytes;
} place_t;

static uint64_t begin_address, end_address;
static FILE *out, *profile;
static bool counting;
static uint64_t n_counted;
static place_t places[CODE_BYTES_MAX / 2];
static place_t *last; /* the instruction before this one, in the same interval */

static void on_insn(unsigned int vcpu, void *userdata)
{
    (void)vcpu;
    place_t *const here = userdata;
    n_counted += counting;
    if (!counting) {
        return;
    }
    ++here->n_executed;
    if (last != NULL) {
        last->n_taken += here != last + last->n_bytes / 2;
    }
    last = here;
}

/* Write and clear the profile of an interval. */
static void write_profile(void)
{
    for (uint32_t i = 0; i < CODE_BYTES_MAX / 2; ++i) {
        if (places[i].n_executed > 0) {
            fprintf(profile, "%" PRIx32 " %" PRIu64 " %" PRIu64 "\n", 2 * i, places[i].n_executed,
                    places[i].n_taken);
            places[i].n_executed = places[i].n_taken = 0;
        }
    }
    fputs("\n", profile);
    fflush(profile); /* QEMU may exit without closing files */
}

static void on_begin(unsigned int vcpu, void *userdata)
{
    (void)vcpu;
    (void)userdata;
    counting = true;
    n_counted = 0;
    last = NULL;
}

static void on_end(unsigned int vcpu, void *userdata)
{
    (void)vcpu;
    (void)userdata;
    if (counting) {
        fprintf(out, "%" PRIu64 "\n", n_counted);
        fflush(out);
        if (profile != NULL) {
            write_profile();
        }
    }
    counting = false;
}

static void on_translated(qemu_plugin_id_t id, struct qemu_plugin_tb *tb)
{
    (void)id;
    for (size_t i = 0; i < qemu_plugin_tb_n_insns(tb); ++i) {
        struct qemu_plugin_insn *const insn = qemu_plugin_tb_get_insn(tb, i);
        const uint64_t address = qemu_plugin_insn_vaddr(insn);
        const insn_executed_t callback = address == begin_address ? on_begin
                                         : address == end_address ? on_end
                                                                  : on_insn;
        place_t *const place = &places[address / 2 % (CODE_BYTES_MAX / 2)];
        place->n_bytes = (uint32_t)qemu_plugin_insn_size(insn);
        qemu_plugin_register_vcpu_insn_exec_cb(insn, callback, QEMU_PLUGIN_CB_NO_REGS, place);
    }
}

/* The value of argument "key=value", or NULL. */
static const char *argument(const char *key, int argc, char **argv)
{
    const size_t key_bytes = strlen(key);
    for (int i = 0; i < argc; ++i) {
        if (strncmp(argv[i], key, key_bytes) == 0 && argv[i][key_bytes] == '=') {
            return argv[i] + key_bytes + 1;
        }
    }
    return NULL;
}

int qemu_plugin_install(qemu_plugin_id_t id, const qemu_info_t *info, int argc, char **argv)
{
    (void)info;
    const char *const begin = argument("begin", argc, argv);
    const char *const end = argument("end", argc, argv);
    const char *const path = argument("out", argc, argv);
    if (begin == NULL || end == NULL || path == NULL) {
        fputs("icount: needs begin=ADDRESS,end=ADDRESS,out=FILE\n", stderr);
        return -1;
    }
    begin_address = strtoull(begin, NULL, 16);
    end_address = strtoull(end, NULL, 16);
    out = fopen(path, "w");
    const char *const profile_path = argument("profile", argc, argv);
    profile = profile_path != NULL ? fopen(profile_path, "w") : NULL;
    if (out == NULL || (profile_path != NULL && profile == NULL)) {
        perror(out == NULL ? path : profile_path);
        return -1;
    }
    qemu_plugin_register_vcpu_tb_trans_cb(id, on_translated);
    return 0;
}
