# gpom: the only build entry point. One invocation builds one toolchain and configuration into
# build/<toolchain>-<config>/; targets that need several call this file again. `make help` lists
# what there is. Only tools/setup touches the network. Here are the options and flags; sources and
# rules are in tools/make/, one part for each purpose.

CROSS  ?=
# Any processor with its flags, CPU_FLAGS="-mcpu=cortex-m33 ..."; of some the flags are known below.
# CPU is then but a name, which the build directory has.
CPU    ?= $(if $(CPU_FLAGS),other,cortex-m7)
# 1: a microcontroller, without operating system, as the names of its compilers tell
# (arm-none-eabi-, riscv32-unknown-elf-); 0: this machine, or another that runs Linux.
BARE   ?= $(if $(filter %-none-eabi- %-elf-,$(CROSS)),1,0)
CONFIG ?= $(if $(CROSS),$(CPU),release)
BUILD  ?= build/$(or $(patsubst %-,%,$(notdir $(CROSS))),host)-$(CONFIG)
# Queries side by side: a number, or auto: chosen at run time from SSE2, AVX2 and AVX-512.
ISA    := $(if $(CROSS),$(CPU),$(shell uname -m))
LANES  ?= $(if $(filter 1,$(BARE)),1,$(if $(filter x86_64,$(ISA)),auto,4))
FMA    ?= $(BARE)
MINNUM ?= $(if $(filter cortex-m7,$(if $(CROSS),$(CPU))),1,0)
# 1: neighbourhoods of more than 64 points, with SuiteSparse (LDL and AMD, linked dynamically).
SPARSE ?= $(if $(CROSS),0,1)
EXEC   ?=
SEED   ?=
LOG    ?=
DATA   ?= ../shared/data
PREFIX ?= /usr/local
DESTDIR ?=
SYSCONFDIR ?= $(if $(filter /usr,$(PREFIX)),/etc,$(PREFIX)/etc)
LCM_GEN ?= lcm-gen
SOAK_S ?= 600
KILLS  ?= 200
FUZZ_RUNS    ?=
FUZZ_SECONDS ?=
V      ?=
SKIP_BASE ?=
comma  := ,
SAN    ?= $(if $(filter sanitize,$(CONFIG)),address$(comma)undefined)$(if \
          $(filter thread,$(CONFIG)),thread)
# 1: the shared library, too. And what make install brings: 1: daemon and tools, too.
SHARED ?= $(if $(filter 1,$(BARE))$(SAN),0,1)
PROGRAMS ?= $(if $(CROSS),0,1)
EIGEN  ?= /usr/include/eigen3

ifeq ($(origin CC),default) # ?= would not override make's built-in value
CC := $(CROSS)gcc
endif
ifeq ($(origin CXX),default)
CXX := $(CROSS)g++
endif
ifeq ($(origin AR),default)
AR := $(CROSS)ar
endif
OBJDUMP ?= $(CROSS)objdump

ifeq ($(MAKELEVEL),0) # all cores, unless the command line says otherwise
MAKEFLAGS := $(MAKEFLAGS) $(if $(filter -j% --jobs%,$(MAKEFLAGS)),,-j$(shell nproc))
endif
MAKEFLAGS += --no-builtin-rules
.DELETE_ON_ERROR:
Q    := $(if $(V),,@)
MAKE := $(MAKE) --no-print-directory

# --- Flags -------------------------------------------------------------------------------------

CPU_cortex-m7 := -mcpu=cortex-m7 -mthumb -mfloat-abi=hard -mfpu=fpv5-d16
CPU_cortex-m4 := -mcpu=cortex-m4 -mthumb -mfloat-abi=hard -mfpu=fpv4-sp-d16
CPU_armv8-a   := -march=armv8-a
CPU_s390x     := -march=z196
ifneq ($(CROSS),)
CPU_FLAGS ?= $(or $(CPU_$(CPU)),$(error CPU=$(CPU) is unknown; use cortex-m7, cortex-m4, \
             armv8-a or s390x, or give any other one by its flags: CPU_FLAGS="-mcpu=..."))
export CCACHE_DISABLE := 1 # it would not keep the call graphs
MODE_bare := -O2 -DNDEBUG -DEIGEN_NO_DEBUG -DGPOM_ASSERTS=0 -fno-asynchronous-unwind-tables \
             -fstack-usage -fcallgraph-info=su
endif
MODE_release  := -O2 -g -fPIC -DNDEBUG -DEIGEN_NO_DEBUG -DGPOM_ASSERTS=0
MODE_sanitize := -O1 -g -fPIC -DGPOM_ASSERTS=1 -fno-omit-frame-pointer
MODE_thread   := -O1 -g -fPIC -DGPOM_ASSERTS=1
MODE_debug    := -O0 -g -fPIC -DGPOM_ASSERTS=1
MODE := $(or $(MODE_$(if $(filter 1,$(BARE)),bare,$(if $(CROSS),release,$(CONFIG)))),\
             $(error CONFIG=$(CONFIG) is unknown; use release, sanitize, thread or debug))
MODE += $(if $(SAN),-fsanitize=$(SAN) -fno-sanitize-recover=all)

# What the firmware image maps: a street, a preset and 100 points; tests ask gpom-query the same.
STREET := build/host-release/street

WARN := -Wall -Wextra -Wshadow -Wconversion -Werror -Wno-psabi
# Same numerics for everything that may inline a core header: see CONTRIBUTING.md on fusing.
NUMERICS  := -ffp-contract=off -fno-math-errno -DGPOM_LANES=$(LANES:auto=4) -DGPOM_FMA=$(FMA) \
             -DGPOM_MINNUM=$(MINNUM) -DGPOM_SPARSE=$(SPARSE) \
             $(if $(filter auto,$(LANES)),-DGPOM_DISPATCH=1) $(if $(VISITS),-DGPOM_COUNT_VISITS)
INCLUDES  := -Iinclude -I. -isystem $(EIGEN)
COMMON    := $(CPU_FLAGS) $(MODE) $(WARN) $(NUMERICS) $(INCLUDES)
CORE_FLAGS := -std=c++17 $(COMMON) -Wdouble-promotion -Wfloat-conversion -Wundef \
              -fno-exceptions -fno-rtti -fno-threadsafe-statics \
              -ffunction-sections -fdata-sections -fvisibility=hidden $(CXXFLAGS)
# Headers of test libraries without code, for cross compilers, which do not look where they are.
CROSS_INCLUDE := $(BUILD)/target/include
# -g1: a stack trace needs functions and lines alone, and variables cost a tenth of compiling.
HOST_FLAGS := -std=c++17 $(COMMON) -g1 $(if $(CROSS),-isystem $(CROSS_INCLUDE)) -pthread \
              $(CXXFLAGS)
# What runs briefly: command lines, and the tests' own code. Compiling it for speed costs twice the
# time, for the sanitizers three times. The library beside it is compiled as ever.
BRIEF_release  := -O1
BRIEF_sanitize := -O0
BRIEF_FLAGS    := $(HOST_FLAGS) $(if $(CROSS),,$(BRIEF_$(CONFIG)))
C99_FLAGS  := -std=c99 -pedantic-errors $(COMMON) $(CFLAGS)
# The codec is part of the firmware: the same rules as for the core, in C.
CODEC_FLAGS := -std=c99 -pedantic-errors $(COMMON) -Wdouble-promotion -Wfloat-conversion -Wundef \
               -ffunction-sections -fdata-sections -fvisibility=hidden $(CFLAGS)
PORT_FLAGS := -std=c99 -ffreestanding $(COMMON) -I$(STREET) -Ibuild/host-release/include \
              -ffunction-sections -fdata-sections $(CFLAGS)

# --- Parts -------------------------------------------------------------------------------------

help: ## List the targets
	@sed -n 's/^\([a-z][a-z_.-]*\):.*## \(.*\)/\1|\2/p' $(PARTS) | \
	    awk -F '|' '{ printf "  %-21s %s\n", $$1, $$2 }'
	@echo "Variables: CROSS CPU CPU_FLAGS BARE CONFIG EXEC SAN SEED V LANES FMA SPARSE SHARED LOG" \
	    "DATA SKIP_BASE FUZZ_RUNS FUZZ_SECONDS SOAK_S KILLS GARBAGE_BYTES PREFIX DESTDIR" \
	    "SYSCONFDIR PROGRAMS"
.PHONY: help
.DEFAULT_GOAL := help

include tools/make/rules.mk # first: the other parts call what it defines
include tools/make/core.mk
include tools/make/ports.mk
include tools/make/tools.mk
include tools/make/tests.mk
include tools/make/firmware.mk
include tools/make/bench.mk
include tools/make/install.mk
include tools/make/dev.mk
include tools/make/figures.mk
include tools/make/params.mk
include tools/make/examples.mk
include tools/make/python.mk
include tools/make/docs.mk
PARTS := $(filter Makefile %.mk,$(MAKEFILE_LIST))
