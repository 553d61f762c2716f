/* QEMU TCG plugin: counts the instructions executed between two marker functions.
 *
 *   -plugin libicount.so,begin=ADDRESS,end=ADDRESS,out=FILE
 *
 * ADDRESS is a marker's first instruction (hexadecimal, without the Thumb bit). Each interval adds
 * one line to FILE: the number of instructions between the first instruction of marker `begin` and
 * the first instruction of marker `end`, without these two. The plugin counts instructions, not
 * cycles, because QEMU does not model pipeline, cache and flash wait states.
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
size_t qemu_plugin_tb_n_insns(const struct qemu_plugin_tb *tb);
struct qemu_plugin_insn *qemu_plugin_tb_get_insn(const struct qemu_plugin_tb *tb, size_t i_insn);
uint64_t qemu_plugin_insn_vaddr(const struct qemu_plugin_insn *insn);

#define EXPORT __attribute__((visibility("default")))
EXPORT int qemu_plugin_version = 1;
EXPORT int qemu_plugin_install(qemu_plugin_id_t id, const qemu_info_t *info, int argc, char **argv);

static uint64_t begin_address, end_address;
static FILE *out;
static bool counting;
static uint64_t n_counted;

static void on_insn(unsigned int vcpu, void *userdata)
{
    (void)vcpu;
    (void)userdata;
    n_counted += counting;
}

static void on_begin(unsigned int vcpu, void *userdata)
{
    (void)vcpu;
    (void)userdata;
    counting = true;
    n_counted = 0;
}

static void on_end(unsigned int vcpu, void *userdata)
{
    (void)vcpu;
    (void)userdata;
    if (counting) {
        fprintf(out, "%" PRIu64 "\n", n_counted);
        fflush(out); /* QEMU may exit without closing files */
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
        qemu_plugin_register_vcpu_insn_exec_cb(insn, callback, QEMU_PLUGIN_CB_NO_REGS, NULL);
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
    if (out == NULL) {
        perror(path);
        return -1;
    }
    qemu_plugin_register_vcpu_tb_trans_cb(id, on_translated);
    return 0;
}
