# gpom: the only build entry point. One invocation builds one toolchain and configuration into
# build/<toolchain>-<config>/; targets that need several call this file again. `make help` lists
# what there is. Only tools/setup touches the network.

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
# Same numerics for everything that may inline a core header: see STYLE on fusing.
NUMERICS  := -ffp-contract=off -fno-math-errno -DGPOM_LANES=$(LANES:auto=4) -DGPOM_FMA=$(FMA) \
             -DGPOM_MINNUM=$(MINNUM) -DGPOM_SPARSE=$(SPARSE) \
             $(if $(filter auto,$(LANES)),-DGPOM_DISPATCH=1)
INCLUDES  := -Iinclude -I. -isystem $(EIGEN)
COMMON    := $(CPU_FLAGS) $(MODE) $(WARN) $(NUMERICS) $(INCLUDES)
CORE_FLAGS := -std=c++17 $(COMMON) -Wdouble-promotion -Wfloat-conversion -Wundef \
              -fno-exceptions -fno-rtti -fno-threadsafe-statics \
              -ffunction-sections -fdata-sections -fvisibility=hidden $(CXXFLAGS)
TOOL_LIBS  := -lz -lbz2 -loctomap -loctomath
# Headers of test libraries without code, for cross compilers, which do not look where they are.
CROSS_INCLUDE := $(BUILD)/target/include
HOST_FLAGS := -std=c++17 $(COMMON) $(if $(CROSS),-isystem $(CROSS_INCLUDE)) -pthread $(CXXFLAGS)
C99_FLAGS  := -std=c99 -pedantic-errors $(COMMON) $(CFLAGS)
# The codec is part of the firmware: the same rules as for the core, in C.
CODEC_FLAGS := -std=c99 -pedantic-errors $(COMMON) -Wdouble-promotion -Wfloat-conversion -Wundef \
               -ffunction-sections -fdata-sections -fvisibility=hidden $(CFLAGS)
PORT_FLAGS := -std=c99 -ffreestanding $(COMMON) -I$(STREET) -Ibuild/host-release/include \
              -ffunction-sections -fdata-sections $(CFLAGS)

# --- Sources -----------------------------------------------------------------------------------

objects = $(patsubst %,$(BUILD)/obj/%.o,$(basename $(1)))

CORE_OBJ  := $(call objects,$(filter-out $(if $(filter 0,$(SPARSE)),src/gp/sparse_gp.cpp),\
                $(wildcard src/*/*.cpp)))
# What every program with the library in it is linked with.
CORE_LIBS := $(if $(filter 1,$(SPARSE)),-lldl -lamd) -lm
LCM_TOOL_SRC := tools/gpom_replay.cpp tools/gpom_bridge.cpp # built of the daemon's parts
TOOL_SRC  := $(filter-out $(LCM_TOOL_SRC) tools/gpom_params.cpp,$(wildcard tools/gpom_*.cpp))
# The hot path once more for each instruction set, in a namespace of its own.
ISA_avx2   := -Dgpom=gpom_avx2 -UGPOM_LANES -DGPOM_LANES=8 -UGPOM_FMA -DGPOM_FMA=1 -mavx2 -mfma
ISA_avx512 := -Dgpom=gpom_avx512 -UGPOM_LANES -DGPOM_LANES=16 -UGPOM_FMA -DGPOM_FMA=1 \
              -mavx512f -mavx512vl -mavx512bw -mavx512dq
ISA_OBJ    := $(if $(filter auto,$(LANES)),$(BUILD)/obj/src/query/answer_avx2.o \
              $(BUILD)/obj/src/query/answer_avx512.o)
TOOL_OBJ  := $(call objects,$(TOOL_SRC))
TOOLS_LIB := $(call objects,$(wildcard ports/host/*.cpp tools/*/*.cpp))
UNIT_SRC  := $(wildcard tests/common/*.cpp tests/unit/*/*.cpp tests/host/*.cpp \
               tests/tools/*.cpp)
TEST_OBJ  := $(call objects,$(filter-out $(if $(filter 0,$(SPARSE)),tests/unit/gp/test_sparse.cpp),\
               $(UNIT_SRC)))
# Those of the core alone, without a library that a cross compiler would lack.
CORE_TEST_OBJ := $(filter $(TEST_OBJ),$(call objects,$(shell \
    grep -L -e '"tools/' -e '"ports/' -e zlib -e snapshot_medium $(UNIT_SRC))))
SNAPSHOT_OBJ := $(call objects,$(wildcard tests/processors/*.cpp))
TSAN_OBJ  := $(call objects,$(wildcard tests/tsan/*.cpp))
C99_OBJ   := $(call objects,$(wildcard tests/api_c99/*.c))
PORT_OBJ  := $(call objects,$(filter-out %_plugin.c,$(wildcard ports/cortex_m/*.c)))
UART_OBJ  := $(call objects,$(wildcard ports/uart/*.c))
TEMPLATE_OBJ := $(call objects,$(wildcard ports/template/*.c))
# The daemon; what it shares with the tools are the readers of files.
LINUX_OBJ := $(call objects,$(wildcard ports/linux/*.cpp ports/linux/*/*.cpp))
LINUX_LIB := $(filter-out %/gpomd.o,$(LINUX_OBJ)) \
             $(call objects,ports/host/params_toml ports/host/toml_table ports/host/snapshot_file)
LCM_TOOL_OBJ := $(call objects,$(LCM_TOOL_SRC) $(wildcard tests/linux/*.cpp))
LCM_TOOLS := $(BUILD)/gpomd $(BUILD)/gpom-replay $(BUILD)/library-map $(BUILD)/linux_tests \
             $(BUILD)/gpom-bridge
CODEC_SRC := $(wildcard ports/codec/*.c)
CODEC_OBJ := $(call objects,$(CODEC_SRC))
FUZZERS   := $(patsubst tests/fuzz/%.cpp,build/host-fuzz/%,$(wildcard tests/fuzz/*.cpp))
FUZZ_FLAGS := -O1 -g -fsanitize=fuzzer,address,undefined -fno-sanitize-recover=all \
              -I$(CURDIR)/include -I$(CURDIR)
CODEC_TEST_SRC := $(filter-out tests/codec/codec_echo.cpp,$(wildcard tests/codec/*.cpp))
CODEC_TEST_OBJ := $(call objects,$(CODEC_TEST_SRC))
CODEC_ECHO_OBJ := $(call objects,tests/codec/codec_echo.cpp)
TOOLS     := $(subst _,-,$(TOOL_SRC:tools/%.cpp=$(BUILD)/%))
SCRIPT_SRC := $(wildcard tools/*/gpom_*.py) tools/report/exact_gp.py
SCRIPTS   := $(subst _,-,$(patsubst %.py,$(BUILD)/%,$(notdir $(SCRIPT_SRC))))
# gpom-some-script runs tools/SOME_FOLDER/gpom_some_script.py.
script_of  = $(filter %/$(subst -,_,$(1)).py,$(SCRIPT_SRC))

# CAN: frames and the example, C99 as the codec.
CAN_SRC      := $(wildcard ports/can/*.c ports/can/examples/*.c)
CAN_OBJ      := $(call objects,$(CAN_SRC))
CAN_TEST_OBJ := $(call objects,$(wildcard tests/can/*.cpp))

# Readers of recorded scans.
SCAN_LIB  := $(call objects,$(patsubst %,ports/host/%.cpp,scan_log carmen_log scan_times \
             laser_angles text_lines packed_file))
BENCH_LIB := $(SCAN_LIB) $(call objects,$(patsubst %,tools/%.cpp,sim/street sim/street_drive \
             sim/street_world sim/truth map/host_map) ports/host/params_toml ports/host/toml_table)
BENCH_OBJ := $(call objects,$(wildcard bench/*.cpp))
# The solve alone, compiled as the hot path is; kernel_constants() comes from the same namespace.
BENCH_ISAS := $(if $(filter auto,$(LANES)),avx2 avx512)
BENCH_ISA_OBJ := $(foreach isa,$(BENCH_ISAS),$(BUILD)/obj/bench/solve_$(isa).o \
                 $(BUILD)/obj/bench/kernel_$(isa).o)

# --- Public targets ----------------------------------------------------------------------------

help: ## List the targets
	@sed -n 's/^\([a-z][a-z-]*\):.*## \(.*\)/\1|\2/p' $(firstword $(MAKEFILE_LIST)) | \
	    awk -F '|' '{ printf "  %-15s %s\n", $$1, $$2 }'
	@echo "Variables: CROSS CPU CPU_FLAGS BARE CONFIG EXEC SAN SEED V LANES FMA SPARSE SHARED LOG" \
	    "DATA SKIP_BASE FUZZ_RUNS FUZZ_SECONDS SOAK_S KILLS GARBAGE_BYTES PREFIX DESTDIR" \
	    "SYSCONFDIR PROGRAMS"

lib: $(BUILD)/libgpom.a $(if $(filter 1,$(SHARED)),$(BUILD)/libgpom.so) ## Build the library

tools: $(TOOLS) $(SCRIPTS) ## Build the host tools

results: tools build/setup/results bench ## Judge all methods, and their speed: RESULTS.md
	$(Q)$(BUILD)/gpom-results --build $(BUILD) --data $(DATA) --bench build/bench --out RESULTS.md

codec: $(BUILD)/libgpom_codec.a ## Build the LCM codec (ports/codec; with CROSS= for firmware)

bench-insert: tools ## Time inserting scans into a map of 20,000 beams, one with room and a full one
	@mkdir -p build/bench
	$(Q)for beam_max in 40000 20000; do \
	    $(BUILD)/gpom-live insert --params tools/params/street.toml --keep 0.1 --kept 20000 --runs 3 \
	        --beam-max $$beam_max --json build/bench/insert-of-$$beam_max.json || exit 1; \
	done
	$(Q)python3 bench/ratios.py --insert build/bench/insert-of-*.json

gpomd: $(BUILD)/gpom-bridge
gpomd: $(BUILD)/gpomd $(BUILD)/gpom-replay $(BUILD)/gpom-watch ## Build LCM daemon and its tools

demo-lcm: gpomd $(BUILD)/gpom-sim $(BUILD)/gpom-query ## Replay a street or LOG into gpomd, compare
	$(Q)SEED=$(SEED) GPOM_BUILD=$(abspath $(BUILD)) tools/demo_lcm $(LOG)

soak: gpomd $(BUILD)/gpom-sim ## Load gpomd for SOAK_S seconds, kill it KILLS times
	$(Q)GPOM_BUILD=$(abspath $(BUILD)) GPOM_SOAK_S=$(SOAK_S) GPOM_KILLS=$(KILLS) \
	    build/venv/bin/python -m pytest -q -s -p no:cacheprovider tests/linux/test_endurance.py

CARS = $(BUILD)/gpom-live cars --params tools/params/street.toml --scans 80 --keep 0.1 \
       $(if $(SEED),--seed $(SEED))
demo-cars: tools ## Vehicles leave (spurious returns or not) or arrive on a street: build/demo-cars
	@mkdir -p build/demo-cars
	$(Q)$(CARS) --cars-leave-at 40 --json build/demo-cars/leave.json
	$(Q)$(CARS) --cars-leave-at 40 --spurious 0.05 --json build/demo-cars/spurious.json
	$(Q)$(CARS) --cars-leave-at -1 --cars-arrive-at 40 --json build/demo-cars/arrive.json
	$(Q)build/venv/bin/python tools/view/cars_picture.py $(foreach i,leave spurious arrive, \
	    build/demo-cars/$i.json) --out build/demo-cars/map.png

demo-doors: tools ## Doors in a live map, a low-resolution map and OctoMap: build/demo-doors
	@mkdir -p build/demo-doors
	$(Q)$(BUILD)/gpom-live door --params tools/params/indoor.toml $(if $(SEED),--seed $(SEED)) \
	    --json build/demo-doors/doors.json
	$(Q)for stage in past through; do build/venv/bin/python tools/view/door_picture.py \
	    build/demo-doors/doors.json --stage $$stage --out build/demo-doors/$$stage.png || exit; done

demo: tools ## Simulate or replay LOG, build a map, evaluate and plot it
	$(Q)SEED=$(SEED) GPOM_BUILD=$(abspath $(BUILD)) tools/demo $(LOG)

fuzz: fuzzers ## Fuzz each decoder: FUZZ_RUNS inputs, or FUZZ_SECONDS
	$(Q)$(RUN_TESTS) fuzz

test: test-programs ## Run the tests of library and tools (unit also under ASan and UBSan)
	$(Q)$(RUN_TESTS) --summary build/test-summary.json base

test-all: $(if $(SKIP_BASE),,test-programs)
test-all: build/setup/lint build/setup/install build/setup/can linux-tests can-tests fuzzers
test-all: count-queries test-firmware-programs ## Run `test`, processors, firmware, CAN, fuzz, lint
	$(Q)$(MAKE) CONFIG=sanitize build/host-sanitize/gpomd build/host-sanitize/linux_tests
	$(Q)$(MAKE) CONFIG=thread tsan build/host-thread/gpomd
	$(Q)$(MAKE) processors
	$(Q)$(RUN_TESTS) --summary build/test-all-summary.json $(if $(SKIP_BASE),,base) extra

bench: build/setup/bench $(BUILD)/speed bench-insert ## Compare with Eigen, nanoflann, sklearn
	@mkdir -p build/bench && rm -f build/bench/sklearn.json
	$(Q)if build/venv/bin/python -c 'import sklearn' 2>/dev/null; then \
	    $(BUILD)/speed --neighbourhoods build/bench/neighbourhoods.json && \
	    build/venv/bin/python bench/sklearn_gp.py build/bench/neighbourhoods.json \
	        build/bench/sklearn.json; \
	else echo "bench: no scikit-learn in build/venv (tools/setup python results): left out"; fi
	$(Q)GPOM_DATA=$(abspath $(DATA)) $(BUILD)/speed --benchmark_out=build/bench/speed.json \
	    --benchmark_counters_tabular=true --benchmark_repetitions=5 \
	    --benchmark_enable_random_interleaving=true --benchmark_report_aggregates_only=true \
	    --benchmark_min_time=0.1 $(BENCH_FLAGS)
	$(Q)python3 bench/ratios.py --speed build/bench/speed.json \
	    --sklearn build/bench/sklearn.json --insert build/bench/insert-of-*.json | \
	    tee build/bench/ratios.txt

bench-instructions: count-queries ## Instructions per query, scalar, by callgrind
	$(Q)python3 tests/instructions.py --json build/bench/instructions.json

test-can: can-tests build/setup/can ## Test CAN: frames, and gpomd on vcan or in a QEMU guest
	$(Q)$(RUN_TESTS) can

lint: build/setup/lint $(STREET)/street.h ## Check formatting, house rules and clang-tidy
	$(Q)python3 tools/dev/lint.py format rules tidy

format: build/setup/lint ## Format all C and C++ sources in place
	$(Q)python3 tools/dev/lint.py reformat

check-symbols: $(BUILD)/libgpom_device.a $(BUILD)/libgpom_can.a
check-symbols: lib codec ## Fail on any heap, libc or global-state symbol in library or codec
	$(Q)python3 tools/dev/check_symbols.py --objdump $(OBJDUMP) \
	    $(if $(filter 1,$(SPARSE)),--sparse) $(BUILD)/libgpom.a
	$(Q)python3 tools/dev/check_symbols.py --objdump $(OBJDUMP) $(BUILD)/libgpom_codec.a
	$(Q)python3 tools/dev/check_symbols.py --objdump $(OBJDUMP) --port $(BUILD)/libgpom_device.a
	$(Q)python3 tools/dev/check_symbols.py --objdump $(OBJDUMP) $(BUILD)/libgpom_can.a

firmware: build/setup/firmware ## Build library and images for CPU (cortex-m7, cortex-m4)
	$(Q)$(MAKE) CROSS=arm-none-eabi- CPU=$(CPU) firmware-image

test-firmware: test-firmware-programs ## Run the images in QEMU: results, counts, sizes, stack
	$(Q)$(RUN_TESTS) firmware

demo-firmware: firmware firmware-host ## A street over LCM and a UART into QEMU: build/demo-firmware
	$(Q)GPOM_BUILD=$(abspath $(BUILD)) tools/demo_firmware

# Of Python only what draws: it runs with the user's Python, not with build/venv.
INSTALLED = $(if $(filter 1,$(PROGRAMS)),$(TOOLS) \
            $(addprefix $(BUILD)/,gpom-params gpomd gpom-replay gpom-bridge))
install: lib presets $(INSTALLED) ## Install library, presets, programs: PREFIX, DESTDIR, SHARED=0
	$(Q)BUILD=$(BUILD) PREFIX="$(PREFIX)" DESTDIR="$(DESTDIR)" SYSCONFDIR="$(SYSCONFDIR)" \
	    PRESETS=$(PRESETS)/gpom/presets SHARED=$(SHARED) PROGRAMS="$(INSTALLED)" \
	    LIBRARIES="$(strip $(CORE_LIBS))" tools/install/install

clean: ## Remove what was built, keep the installed Python environment
	$(Q)rm -rf build/host-* build/arm-none-eabi-* build/aarch64-linux-gnu-* build/s390x-linux-gnu-*

distclean: ## Remove build/ whole
	$(Q)rm -rf build

.PHONY: help lib tools codec gpomd bench bench-insert bench-instructions count-queries demo \
        demo-cars demo-doors demo-lcm soak results fuzz test test-all lint format check-symbols \
        firmware test-firmware clean distclean test-programs unit tsan processors codec-tests \
        linux-tests can-tests test-can fuzzers firmware-image firmware-host \
        test-firmware-programs demo-firmware install FORCE
.DEFAULT_GOAL := help

# --- Behind them -------------------------------------------------------------------------------

RUN_TESTS = SEED=$(SEED) EXEC="$(EXEC)" GPOM_DATA=$(abspath $(DATA)) \
            GPOM_BUILD=$(abspath build/host-release) FUZZ_RUNS=$(FUZZ_RUNS) \
            FUZZ_SECONDS=$(FUZZ_SECONDS) python3 tests/run.py

test-programs: lib tools unit codec-tests linux-tests $(BUILD)/api_c99 $(BUILD)/template_test \
    build/setup/python
	$(Q)$(MAKE) CONFIG=sanitize unit codec-tests build/host-sanitize/template_test

unit: $(BUILD)/unit_tests

tsan: $(BUILD)/tsan_tests

count-queries: build/setup/firmware
	$(Q)$(MAKE) CROSS= CPU= LANES=1 FMA=0 BUILD=build/host-scalar build/host-scalar/count-queries

fuzzers: $(FUZZERS)

# None with fused operations, as the host's, so that the same scans give the same map.
ARM64      := CROSS=aarch64-linux-gnu- CPU=armv8-a LANES=4 FMA=0
BIG_ENDIAN := CROSS=s390x-linux-gnu- CPU=s390x LANES=1 FMA=0
processors: $(BUILD)/snapshot_bytes ## Build tests for 64-bit Arm and a big-endian processor
	$(Q)if tools/setup processors; then \
	    $(MAKE) $(ARM64) $(addprefix build/aarch64-linux-gnu-armv8-a/,snapshot_bytes \
	        core_tests api_c99) && \
	    $(MAKE) $(BIG_ENDIAN) build/s390x-linux-gnu-s390x/snapshot_bytes; \
	else echo "no cross compilers: tests on other processors will be skipped"; fi

linux-tests: gpomd $(BUILD)/gpom-sim $(BUILD)/gpom-query $(BUILD)/library-map \
    $(BUILD)/linux_tests $(BUILD)/lcm/stamp

codec-tests: $(BUILD)/codec_tests $(BUILD)/codec-echo

# The PC's scalar path: one lane, multiply-adds fused, as on the microcontroller.
FUSED := build/host-fused
firmware-host: gpomd $(BUILD)/gpom-query build/setup/python
	$(Q)$(MAKE) CROSS= CPU= CONFIG=release LANES=1 FMA=1 BUILD=$(FUSED) $(FUSED)/gpom-query \
	    $(FUSED)/library-map

test-firmware-programs: firmware firmware-host
	$(Q)$(MAKE) CROSS=arm-none-eabi- CPU=cortex-m7 build/arm-none-eabi-cortex-m7/target_tests.elf
	$(Q)$(MAKE) CPU=cortex-m4 firmware

firmware-image: $(foreach i,demo costs device template,$(BUILD)/gpom_$(i).elf) \
    $(BUILD)/libgpom_can.a build/host-release/libicount.so
	$(Q)tests/firmware/budget.py $(CPU)

build/setup/results build/setup/can: build/setup/python
build/setup/%: tools/setup tools/requirements.txt tools/requirements-results.txt \
    tools/requirements-can.txt
	$(Q)tools/setup $*

# Objects are made again when a flag changes, not only when a file does.
$(BUILD)/flags: FORCE
	@mkdir -p $(@D)
	@echo '$(CC) $(CXX) $(CORE_FLAGS) $(HOST_FLAGS)' | cmp -s - $@ || \
	    echo '$(CC) $(CXX) $(CORE_FLAGS) $(HOST_FLAGS)' > $@

$(CORE_OBJ) $(ISA_OBJ) $(TOOL_OBJ) $(TOOLS_LIB) $(TEST_OBJ) $(TSAN_OBJ) $(SNAPSHOT_OBJ) $(C99_OBJ) \
    $(PORT_OBJ) $(BENCH_OBJ) $(BENCH_ISA_OBJ) $(LINUX_OBJ) $(LCM_TOOL_OBJ) $(CODEC_OBJ) \
    $(CODEC_TEST_OBJ) $(CODEC_ECHO_OBJ) $(UART_OBJ) $(TEMPLATE_OBJ): \
    $(BUILD)/flags | build/setup/$(if $(CROSS),$(if $(filter 1,$(BARE)),firmware,processors),base)
$(TEST_OBJ): | build/setup/test $(if $(CROSS),$(CROSS_INCLUDE)/stamp)
$(CODEC_TEST_OBJ): $(BUILD)/lcm/stamp | build/setup/test

define compile # compiler and flags
	@mkdir -p $(@D)
	$(if $(V),,@echo "  CC   $@")
	$(Q)$(1) -MMD -MP -c $< -o $@
endef

# On a microcontroller what runs seldom, or is short, is compiled for size; on the smallest one also
# what costs few instructions for its bytes.
SMALL_cortex-m4 := insert/known_free insert/witness
SMALL := $(if $(filter 1,$(BARE)),map/config_check beams/index gp/kernel insert/origin \
    raster/lowres raster/lowres_mark refresh/lowres_read refresh/lowres_step map/map \
    $(SMALL_$(CPU)))
$(SMALL:%=$(BUILD)/obj/src/%.o): SIZE := -Os
$(CORE_OBJ): $(BUILD)/obj/%.o: %.cpp
	$(call compile,$(CXX) $(CORE_FLAGS) $(SIZE))
$(ISA_OBJ): $(BUILD)/obj/src/query/answer_%.o: src/query/answer.cpp
	$(call compile,$(CXX) $(CORE_FLAGS) $(ISA_$*))
$(TOOL_OBJ) $(TOOLS_LIB) $(TEST_OBJ) $(TSAN_OBJ) $(SNAPSHOT_OBJ) $(BENCH_OBJ) $(LINUX_OBJ) \
    $(LCM_TOOL_OBJ): $(BUILD)/obj/%.o: %.cpp
	$(call compile,$(CXX) $(HOST_FLAGS))
$(BENCH_ISAS:%=$(BUILD)/obj/bench/solve_%.o): $(BUILD)/obj/bench/solve_%.o: bench/solve.cpp
	$(call compile,$(CXX) $(HOST_FLAGS) $(ISA_$*))
$(BENCH_ISAS:%=$(BUILD)/obj/bench/kernel_%.o): $(BUILD)/obj/bench/kernel_%.o: src/gp/kernel.cpp
	$(call compile,$(CXX) $(HOST_FLAGS) $(ISA_$*))
$(C99_OBJ) $(TEMPLATE_OBJ): $(BUILD)/obj/%.o: %.c
	$(call compile,$(CC) $(C99_FLAGS))
$(CODEC_OBJ) $(UART_OBJ): $(BUILD)/obj/%.o: %.c
	$(call compile,$(CC) $(CODEC_FLAGS))
$(CODEC_TEST_OBJ) $(CODEC_ECHO_OBJ): $(BUILD)/obj/%.o: %.cpp
	$(call compile,$(CXX) $(HOST_FLAGS) -isystem $(BUILD)/lcm)
$(PORT_OBJ): $(BUILD)/obj/%.o: %.c
	$(call compile,$(CC) $(PORT_FLAGS))

$(BUILD)/libgpom.a: $(CORE_OBJ) $(ISA_OBJ)
	$(if $(V),,@echo "  AR   $@")
	$(Q)rm -f $@ && $(AR) crs $@ $^

MAJOR := $(shell sed -n 's/^.define GPOM_VERSION_MAJOR //p' include/gpom/status.h)
# Linked by the C compiler: a need for the C++ runtime is a link error, not a surprise.
$(BUILD)/libgpom.so: $(CORE_OBJ) $(ISA_OBJ)
	$(if $(V),,@echo "  LD   $@")
	$(Q)$(CC) -shared -Wl,-z,defs -Wl,-soname,libgpom.so.$(MAJOR) -o $@ $^ $(CORE_LIBS)
$(BUILD)/api_c99: $(C99_OBJ) $(BUILD)/libgpom.a
	$(if $(V),,@echo "  LD   $@")
	$(Q)$(CC) $(MODE) $(if $(CROSS),-static) -o $@ $^ $(CORE_LIBS)

# The template's program does nothing for ever: that it links is all.
$(BUILD)/template $(BUILD)/template_test: $(BUILD)/obj/ports/template/port.o \
    $(BUILD)/libgpom_device.a $(BUILD)/libgpom_codec.a $(BUILD)/libgpom.a
$(BUILD)/template: $(BUILD)/obj/ports/template/main.o
$(BUILD)/template_test: $(BUILD)/obj/ports/template/host_test.o | $(BUILD)/template
$(BUILD)/template $(BUILD)/template_test:
	$(if $(V),,@echo "  LD   $@")
	$(Q)$(CC) $(MODE) -o $@ $(filter %.o,$^) $(filter %_device.a,$^) $(filter %_codec.a,$^) \
	    $(filter %gpom.a,$^) $(CORE_LIBS)

# What lcm-gen makes of lcmtypes/, for tests only; the prefix keeps its gpom_map_t from ours.
LCM_TYPES := $(wildcard lcmtypes/*.lcm)
LCM_OBJ   := $(LCM_TYPES:lcmtypes/%.lcm=$(BUILD)/lcm/peer_%.o)
$(BUILD)/lcm/stamp: $(LCM_TYPES) | build/setup/lcm
	$(if $(V),,@echo "  LCM  $(@D)")
	$(Q)rm -rf $(@D) && mkdir -p $(@D)
	$(Q)$(LCM_GEN) --package-prefix peer -c --c-no-pubsub --c-cpath $(@D) --c-hpath $(@D) \
	    -x --cpp-hpath $(@D) $(LCM_TYPES)
	$(Q)$(LCM_GEN) -p --ppath $(@D)/python $(LCM_TYPES)
	$(Q)touch $@
$(LCM_OBJ): $(BUILD)/lcm/%.o: $(BUILD)/lcm/stamp
	$(Q)$(CC) $(CPU_FLAGS) $(if $(CROSS),-isystem $(CROSS_INCLUDE)) -std=gnu99 -O2 -g -w \
	    -c $(@:.o=.c) -o $@
$(if $(CROSS),$(LCM_OBJ)): | $(CROSS_INCLUDE)/stamp

$(BUILD)/libgpom_codec.a: $(CODEC_OBJ)
	$(if $(V),,@echo "  AR   $@")
	$(Q)rm -f $@ && $(AR) crs $@ $^
$(BUILD)/codec_tests: $(CODEC_TEST_OBJ) $(BUILD)/obj/tests/common/main.o $(LCM_OBJ) \
    $(BUILD)/libgpom_device.a $(BUILD)/libgpom_codec.a
	$(if $(V),,@echo "  LD   $@")
	$(Q)$(CXX) $(HOST_FLAGS) -o $@ $^ -lz
$(BUILD)/codec-echo: $(CODEC_ECHO_OBJ) $(BUILD)/obj/tests/codec/types.o $(BUILD)/libgpom_codec.a
	$(if $(V),,@echo "  LD   $@")
	$(Q)$(CXX) $(HOST_FLAGS) -o $@ $^ -lz

$(BUILD)/gpomd: $(BUILD)/obj/ports/linux/gpomd.o $(LINUX_LIB)
$(BUILD)/gpom-replay: $(BUILD)/obj/tools/gpom_replay.o \
    $(call objects,ports/linux/lcm/sender ports/linux/base/network ports/host/lcm_log) $(SCAN_LIB)
$(BUILD)/gpom-replay $(BUILD)/library-map: READ_LIBS := -lbz2
$(BUILD)/gpom-bridge: $(call objects,tools/gpom_bridge ports/host/serial_line \
    $(addprefix ports/linux/,lcm/sender lcm/subscriber base/memory base/network)) \
    $(BUILD)/libgpom_device.a
$(BUILD)/library-map: $(BUILD)/obj/tests/linux/library_map.o $(LINUX_LIB) $(SCAN_LIB)
$(BUILD)/linux_tests: $(call objects,$(wildcard tests/linux/test_*.cpp) tests/common/main.cpp) \
    $(LINUX_LIB)
$(LCM_TOOLS): $(BUILD)/libgpom.a $(BUILD)/libgpom_codec.a $(BUILD)/libgpom_can.a
	$(if $(V),,@echo "  LD   $@")
	$(Q)$(CXX) $(HOST_FLAGS) -o $@ $(filter %.o,$^) $(filter %_device.a,$^) \
	    $(filter %_codec.a %_can.a,$^) $(filter %gpom.a,$^) -lz $(READ_LIBS) $(CORE_LIBS)

# --- CAN ---
can-tests: gpomd $(BUILD)/can_tests $(BUILD)/libgpom_can.so $(BUILD)/gpom-sim $(BUILD)/lcm/stamp \
    $(BUILD)/linux_tests
	$(Q)$(MAKE) CONFIG=sanitize build/host-sanitize/can_tests
$(CAN_OBJ): $(BUILD)/obj/%.o: %.c
	$(call compile,$(CC) $(CODEC_FLAGS))
$(CAN_TEST_OBJ): $(BUILD)/obj/%.o: %.cpp | build/setup/test
	$(call compile,$(CXX) $(HOST_FLAGS))
$(CAN_OBJ) $(CAN_TEST_OBJ): $(BUILD)/flags
$(BUILD)/libgpom_can.a: $(CAN_OBJ)
	$(if $(V),,@echo "  AR   $@")
	$(Q)rm -f $@ && $(AR) crs $@ $^
# For tests by ctypes: all that is hidden in the library is open here.
$(BUILD)/libgpom_can.so: $(CAN_SRC) $(wildcard ports/can/*.h ports/can/examples/*.h)
	$(if $(V),,@echo "  LD   $@")
	$(Q)$(CC) -std=c99 -pedantic-errors -shared -O2 -fPIC $(WARN) $(INCLUDES) -o $@ $(CAN_SRC)
$(BUILD)/can_tests: $(CAN_TEST_OBJ) $(BUILD)/obj/tests/common/main.o $(BUILD)/libgpom_can.a
	$(if $(V),,@echo "  LD   $@")
	$(Q)$(CXX) $(HOST_FLAGS) -o $@ $^

# Fuzzers: clang compiles the codec again with libFuzzer's coverage and both sanitizers.
FUZZED_SRC := $(CODEC_SRC) $(CAN_SRC) ports/uart/frame.c
$(FUZZERS): build/host-fuzz/%: tests/fuzz/%.cpp tests/codec/types.cpp $(FUZZED_SRC) \
    $(wildcard ports/*/*.h tests/codec/*.hpp include/gpom/*.h) | build/setup/fuzz
	@mkdir -p $(@D)/$*_obj
	$(if $(V),,@echo "  FUZZ $@")
	$(Q)cd $(@D)/$*_obj && clang -std=c99 $(FUZZ_FLAGS) -c $(abspath $(FUZZED_SRC))
	$(Q)clang++ -std=c++17 $(FUZZ_FLAGS) -o $@ $< tests/codec/types.cpp $(@D)/$*_obj/*.o -lz

$(BUILD)/gpom-odometry: $(call objects,ports/linux/pose/odometry ports/linux/pose/pose_ring)
.SECONDEXPANSION: # gpom-some-tool is made from tools/gpom_some_tool.cpp
$(TOOLS): $(BUILD)/%: $(BUILD)/obj/tools/$$(subst -,_,$$*).o $(TOOLS_LIB) $(BUILD)/libgpom.a
	$(if $(V),,@echo "  LD   $@")
	$(Q)$(CXX) $(HOST_FLAGS) -o $@ $^ $(TOOL_LIBS) $(CORE_LIBS)
$(SCRIPTS): $(BUILD)/%: $$(call script_of,$$*) build/setup/python
	@mkdir -p $(@D)
	@printf '#!/bin/sh\nexec "%s" "%s" "$$@"\n' $(abspath build/venv/bin/python) $(abspath $<) > $@
	@chmod +x $@
$(BUILD)/speed: $(BUILD)/obj/bench/speed.o $(BUILD)/obj/bench/solve.o $(BENCH_ISA_OBJ) \
    $(BENCH_LIB) $(BUILD)/libgpom.a
	$(if $(V),,@echo "  LD   $@")
	$(Q)$(CXX) $(HOST_FLAGS) -o $@ $^ -lbenchmark -lz -lbz2 $(CORE_LIBS)
$(BUILD)/count-queries: $(BUILD)/obj/bench/count_queries.o $(BENCH_LIB) $(BUILD)/libgpom.a
	$(if $(V),,@echo "  LD   $@")
	$(Q)$(CXX) $(HOST_FLAGS) -o $@ $^ -lz -lbz2 $(CORE_LIBS)
$(BUILD)/unit_tests: $(TEST_OBJ) $(TOOLS_LIB) $(BUILD)/libgpom.a
	$(if $(V),,@echo "  LD   $@")
	$(Q)$(CXX) $(HOST_FLAGS) -o $@ $^ $(TOOL_LIBS) $(CORE_LIBS)
$(BUILD)/core_tests: $(CORE_TEST_OBJ) $(BUILD)/libgpom.a
	$(if $(V),,@echo "  LD   $@")
	$(Q)$(CXX) $(HOST_FLAGS) -static -o $@ $^ $(CORE_LIBS)
$(BUILD)/snapshot_bytes: $(SNAPSHOT_OBJ) $(BUILD)/obj/ports/host/snapshot_file.o $(BUILD)/libgpom.a
	$(if $(V),,@echo "  LD   $@")
	$(Q)$(CXX) $(HOST_FLAGS) $(if $(CROSS),-static) -o $@ $^ $(CORE_LIBS)
$(BUILD)/tsan_tests: $(TSAN_OBJ) $(BUILD)/libgpom.a
	$(if $(V),,@echo "  LD   $@")
	$(Q)$(CXX) $(HOST_FLAGS) -o $@ $^ $(CORE_LIBS)

$(STREET)/street.h: tools/dev/street_header.py tests/firmware/scans.csv tests/firmware/points.csv
	@mkdir -p $(@D)
	$(Q)python3 tools/dev/street_header.py tests/firmware/scans.csv tests/firmware/points.csv $@
$(PORT_OBJ): $(STREET)/street.h | presets

LD_SCRIPT := ports/cortex_m/mps2_an500.ld
CORTEX_M := $(BUILD)/obj/ports/cortex_m
$(BUILD)/gpom_demo.elf: $(CORTEX_M)/main.o
$(BUILD)/gpom_costs.elf: $(CORTEX_M)/costs.o
$(BUILD)/gpom_device.elf: $(CORTEX_M)/device_main.o $(CORTEX_M)/mps2.o $(BUILD)/libgpom_device.a \
    $(BUILD)/libgpom_codec.a
$(BUILD)/gpom_template.elf: $(call objects,ports/template/main.c ports/template/port.c) \
    $(BUILD)/libgpom_device.a $(BUILD)/libgpom_codec.a
$(BUILD)/%.elf: $(CORTEX_M)/startup.o $(BUILD)/libgpom.a $(LD_SCRIPT)
	$(if $(V),,@echo "  LD   $@")
	$(Q)$(CC) $(CPU_FLAGS) --specs=nano.specs -nostartfiles -Wl,--gc-sections,--fatal-warnings \
	    -Wl,-Map=$(@:.elf=.map) -T $(LD_SCRIPT) -o $@ $(filter %.o,$^) $(filter %_device.a,$^) \
	    $(filter %_codec.a,$^) $(filter %gpom.a,$^) -lm
# The unit tests that make sense there, as hosted programs under newlib's semihosting: the library
# is the device's, the tests are those of the PC.
TARGET_TESTS := tests/common/main $(foreach i,gp/test_chol lane/test_elementary beams/test_index \
    beams/test_kdtree gp/test_kernel lane/test_lane gp/test_local_gp map/test_map gp/test_params \
    insert/test_reading insert/test_scan lane/test_select,tests/unit/$(i)) \
    $(patsubst %.cpp,%,$(CODEC_TEST_SRC))
TARGET_OBJ := $(TARGET_TESTS:%=$(BUILD)/target/%.o) $(BUILD)/target/tests/firmware/target/boot.o
TARGET_INCLUDE := $(CROSS_INCLUDE) $(BUILD)/lcm tests/firmware/target/include
TARGET_FLAGS := $(CPU_FLAGS) -O2 -Wall -Wextra -Wno-psabi -DNDEBUG -DEIGEN_NO_DEBUG \
    -DGPOM_ASSERTS=0 $(NUMERICS) $(INCLUDES) $(addprefix -isystem ,$(TARGET_INCLUDE)) \
    -ffunction-sections -fdata-sections
TARGET_DOCTEST := $(foreach i,NO_MULTITHREADING NO_POSIX_SIGNALS COLORS_NONE,-DDOCTEST_CONFIG_$(i))
$(TARGET_OBJ): $(BUILD)/flags $(BUILD)/lcm/stamp | $(CROSS_INCLUDE)/stamp
$(CROSS_INCLUDE)/stamp: | build/setup/test build/setup/lcm
	$(Q)mkdir -p $(@D) && ln -sfn /usr/include/doctest /usr/include/lcm $(@D) && touch $@
$(filter-out %/boot.o,$(TARGET_OBJ)): $(BUILD)/target/%.o: %.cpp
	$(call compile,$(CXX) -std=c++17 $(TARGET_FLAGS) $(TARGET_DOCTEST))
$(BUILD)/target/tests/firmware/target/boot.o: tests/firmware/target/boot.c
	$(call compile,$(CC) -std=c99 $(TARGET_FLAGS))
$(BUILD)/target_tests.elf: $(TARGET_OBJ) $(LCM_OBJ) $(BUILD)/libgpom_device.a \
    $(BUILD)/libgpom_codec.a $(BUILD)/libgpom.a tests/firmware/target/tests.ld
	$(if $(V),,@echo "  LD   $@")
	$(Q)$(CXX) $(CPU_FLAGS) --specs=rdimon.specs -Wl,--gc-sections -T $(filter %.ld,$^) -o $@ \
	    $(filter %.o,$^) $(filter %.a,$^) -lm

$(BUILD)/libgpom_device.a: $(UART_OBJ)
	$(if $(V),,@echo "  AR   $@")
	$(Q)rm -f $@ && $(AR) crs $@ $^

# QEMU loads this into itself, so it is always for the host.
build/host-release/libicount.so: ports/cortex_m/icount_plugin.c | build/setup/base
	@mkdir -p $(@D)
	$(Q)cc -std=c99 -O2 $(WARN) -shared -fPIC -o $@ $<

-include $(wildcard $(foreach i,obj target,$(BUILD)/$(i)/*/*.d $(BUILD)/$(i)/*/*/*.d \
    $(BUILD)/$(i)/*/*/*/*.d))

include tools/make/params.mk
include tools/make/examples.mk
