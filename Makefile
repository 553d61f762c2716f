# gpom: the only build entry point. One invocation builds one toolchain and configuration into
# build/<toolchain>-<config>/; targets that need several call this file again. `make help` lists
# what there is. Only tools/setup touches the network.

CROSS  ?=
CPU    ?= cortex-m7
CONFIG ?= $(if $(CROSS),$(CPU),release)
BUILD  ?= build/$(or $(CROSS:%-=%),host)-$(CONFIG)
# Queries side by side: a number, or auto: chosen at run time from SSE2, AVX2 and AVX-512.
LANES  ?= $(if $(CROSS),1,$(if $(filter x86_64,$(shell uname -m)),auto,4))
FMA    ?= $(if $(CROSS),1,0)
EXEC   ?=
SEED   ?=
LOG    ?=
DATA   ?= ../shared/data
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
CPU_s390x     := -march=z196
ifneq ($(CROSS),)
CPU_FLAGS := $(or $(CPU_$(CPU)),$(error CPU=$(CPU) is unknown; use cortex-m7, cortex-m4 or s390x))
MODE_arm  := -O2 -DNDEBUG -DEIGEN_NO_DEBUG -DGPOM_ASSERTS=0 -fno-asynchronous-unwind-tables \
             -fstack-usage -fcallgraph-info=su
endif
MODE_release  := -O2 -g -fPIC -DNDEBUG -DEIGEN_NO_DEBUG -DGPOM_ASSERTS=0
MODE_sanitize := -O1 -g -fPIC -DGPOM_ASSERTS=1 -fno-omit-frame-pointer
MODE_thread   := -O1 -g -fPIC -DGPOM_ASSERTS=1
MODE_debug    := -O0 -g -fPIC -DGPOM_ASSERTS=1
MODE := $(or $(MODE_$(if $(CROSS),arm,$(CONFIG))),\
             $(error CONFIG=$(CONFIG) is unknown; use release, sanitize, thread or debug))
MODE += $(if $(SAN),-fsanitize=$(SAN) -fno-sanitize-recover=all)

# What the firmware image maps: a street, a preset and 100 points; tests ask gpom-query the same.
STREET := build/host-release/street

WARN := -Wall -Wextra -Wshadow -Wconversion -Werror -Wno-psabi
# Same numerics for everything that may inline a core header: see STYLE on fusing.
NUMERICS  := -ffp-contract=off -fno-math-errno -DGPOM_LANES=$(LANES:auto=4) -DGPOM_FMA=$(FMA) \
             $(if $(filter auto,$(LANES)),-DGPOM_DISPATCH=1)
INCLUDES  := -Iinclude -I. -isystem $(EIGEN)
COMMON    := $(CPU_FLAGS) $(MODE) $(WARN) $(NUMERICS) $(INCLUDES)
CORE_FLAGS := -std=c++17 $(COMMON) -Wdouble-promotion -Wfloat-conversion -Wundef \
              -fno-exceptions -fno-rtti -fno-threadsafe-statics \
              -ffunction-sections -fdata-sections -fvisibility=hidden $(CXXFLAGS)
TOOL_LIBS  := -lz -loctomap -loctomath
HOST_FLAGS := -std=c++17 $(COMMON) -pthread $(CXXFLAGS)
C99_FLAGS  := -std=c99 -pedantic-errors $(COMMON) $(CFLAGS)
# The codec is part of the firmware: the same rules as for the core, in C.
CODEC_FLAGS := -std=c99 -pedantic-errors $(COMMON) -Wdouble-promotion -Wfloat-conversion -Wundef \
               -ffunction-sections -fdata-sections -fvisibility=hidden $(CFLAGS)
PORT_FLAGS := -std=c99 -ffreestanding $(COMMON) -I$(STREET) \
              -ffunction-sections -fdata-sections $(CFLAGS)

# --- Sources -----------------------------------------------------------------------------------

objects = $(patsubst %,$(BUILD)/obj/%.o,$(basename $(1)))

CORE_OBJ  := $(call objects,$(wildcard src/*.cpp))
LCM_TOOL_SRC := tools/gpom_replay.cpp # these need liblcm: built with the daemon
TOOL_SRC  := $(filter-out $(LCM_TOOL_SRC),$(wildcard tools/gpom_*.cpp))
# The hot path once more for each instruction set, in a namespace of its own.
ISA_avx2   := -Dgpom=gpom_avx2 -UGPOM_LANES -DGPOM_LANES=8 -UGPOM_FMA -DGPOM_FMA=1 -mavx2 -mfma
ISA_avx512 := -Dgpom=gpom_avx512 -UGPOM_LANES -DGPOM_LANES=16 -UGPOM_FMA -DGPOM_FMA=1 \
              -mavx512f -mavx512vl -mavx512bw -mavx512dq
ISA_OBJ    := $(if $(filter auto,$(LANES)),$(BUILD)/obj/src/answer_avx2.o \
              $(BUILD)/obj/src/answer_avx512.o)
TOOL_OBJ  := $(call objects,$(TOOL_SRC))
TOOLS_LIB := $(call objects,$(wildcard tools/lib/*.cpp))
TEST_OBJ  := $(call objects,$(wildcard tests/unit/*.cpp tests/property/*.cpp))
ENDIAN_OBJ := $(call objects,$(wildcard tests/endian/*.cpp))
TSAN_OBJ  := $(call objects,$(wildcard tests/tsan/*.cpp))
C99_OBJ   := $(call objects,$(wildcard tests/api_c99/*.c))
PORT_OBJ  := $(call objects,$(filter-out %_plugin.c,$(wildcard ports/cortex_m/*.c)))
# The daemon; what it shares with the tools are the readers of files.
LINUX_OBJ := $(call objects,$(wildcard ports/linux/*.cpp))
LINUX_LIB := $(filter-out %/gpomd.o,$(LINUX_OBJ)) \
             $(call objects,tools/lib/params_toml tools/lib/toml_table tools/lib/snapshot_file)
LCM_TOOL_OBJ := $(call objects,$(LCM_TOOL_SRC) $(wildcard tests/linux/*.cpp))
LCM_TOOLS := $(BUILD)/gpomd $(BUILD)/gpom-replay $(BUILD)/library-map $(BUILD)/linux_tests
CODEC_SRC := $(wildcard ports/codec/*.c)
CODEC_OBJ := $(call objects,$(CODEC_SRC))
FUZZERS   := $(patsubst tests/fuzz/%.cpp,build/host-fuzz/%,$(wildcard tests/fuzz/*.cpp))
FUZZ_FLAGS := -O1 -g -fsanitize=fuzzer,address,undefined -fno-sanitize-recover=all \
              -I$(CURDIR)/include -I$(CURDIR)
CODEC_TEST_SRC := $(filter-out tests/codec/codec_echo.cpp,$(wildcard tests/codec/*.cpp))
CODEC_TEST_OBJ := $(call objects,$(CODEC_TEST_SRC))
CODEC_ECHO_OBJ := $(call objects,tests/codec/codec_echo.cpp)
TOOLS     := $(subst _,-,$(TOOL_SRC:tools/%.cpp=$(BUILD)/%))
SCRIPT_SRC := $(wildcard tools/gpom_*.py) tools/exact_gp.py
SCRIPTS   := $(subst _,-,$(SCRIPT_SRC:tools/%.py=$(BUILD)/%))

BENCH_LIB := $(call objects,$(patsubst %,tools/lib/%.cpp,street street_drive street_world scan_log \
             text_lines truth host_map params_toml toml_table))
BENCH_OBJ := $(call objects,$(wildcard bench/*.cpp))

# --- Public targets ----------------------------------------------------------------------------

help: ## List the targets
	@sed -n 's/^\([a-z][a-z-]*\):.*## \(.*\)/\1|\2/p' $(firstword $(MAKEFILE_LIST)) | \
	    awk -F '|' '{ printf "  %-15s %s\n", $$1, $$2 }'
	@echo "Variables: CROSS CPU CONFIG EXEC SAN SEED V LANES FMA LOG DATA SKIP_BASE FUZZ_RUNS" \
	    "FUZZ_SECONDS SOAK_S KILLS"

lib: $(BUILD)/libgpom.a $(if $(CROSS)$(SAN),,$(BUILD)/libgpom.so) ## Build the library

tools: $(TOOLS) $(SCRIPTS) ## Build the host tools

results: tools build/setup/results ## Judge all methods, logs of DATA, streets: RESULTS.md (minutes)
	$(Q)$(BUILD)/gpom-results --build $(BUILD) --data $(DATA) --out RESULTS.md

codec: $(BUILD)/libgpom_codec.a ## Build the LCM codec (ports/codec; with CROSS= for firmware)

bench-insert: tools ## Time inserting scans into a map of 20,000 beams
	$(Q)$(BUILD)/gpom-live insert --params tools/params/street.toml

gpomd: $(BUILD)/gpomd $(BUILD)/gpom-replay $(BUILD)/gpom-watch ## Build the LCM daemon and its tools

demo-lcm: gpomd $(BUILD)/gpom-sim $(BUILD)/gpom-query ## Replay a street or LOG into gpomd, compare
	$(Q)SEED=$(SEED) GPOM_BUILD=$(abspath $(BUILD)) tools/demo_lcm $(LOG)

soak: gpomd $(BUILD)/gpom-sim ## Load gpomd for SOAK_S seconds, kill it KILLS times
	$(Q)GPOM_BUILD=$(abspath $(BUILD)) GPOM_SOAK_S=$(SOAK_S) GPOM_KILLS=$(KILLS) \
	    build/venv/bin/python -m pytest -q -s -p no:cacheprovider tests/linux/test_endurance.py

demo: tools ## Simulate or replay LOG, build a map, evaluate and plot it
	$(Q)SEED=$(SEED) GPOM_BUILD=$(abspath $(BUILD)) tools/demo $(LOG)

fuzz: fuzzers ## Fuzz each decoder: FUZZ_RUNS inputs, or FUZZ_SECONDS
	$(Q)$(RUN_TESTS) fuzz

test: test-programs ## Run the tests of library and tools (unit also under ASan and UBSan)
	$(Q)$(RUN_TESTS) --summary build/test-summary.json base

test-all: $(if $(SKIP_BASE),,test-programs)
test-all: build/setup/lint linux-tests firmware fuzzers count-queries ## Run all tests and lint
	$(Q)$(MAKE) CPU=cortex-m4 firmware
	$(Q)$(MAKE) CONFIG=sanitize build/host-sanitize/gpomd build/host-sanitize/linux_tests
	$(Q)$(MAKE) CONFIG=thread tsan
	$(Q)$(MAKE) endian
	$(Q)$(RUN_TESTS) --summary build/test-all-summary.json $(if $(SKIP_BASE),,base) extra

bench: build/setup/bench $(BUILD)/speed ## Compare with Eigen, nanoflann, FMA peak: build/bench
	@mkdir -p build/bench
	$(Q)$(BUILD)/speed --benchmark_out=build/bench/speed.json --benchmark_counters_tabular=true \
	    --benchmark_repetitions=5 --benchmark_enable_random_interleaving=true \
	    --benchmark_report_aggregates_only=true --benchmark_min_time=0.1 $(BENCH_FLAGS)
	$(Q)python3 bench/ratios.py build/bench/speed.json | tee build/bench/ratios.txt

bench-instructions: count-queries ## Instructions per query, scalar, by callgrind
	$(Q)python3 tests/instructions.py --json build/bench/instructions.json

lint: build/setup/lint $(STREET)/street.h ## Check formatting, house rules and clang-tidy
	$(Q)python3 tools/lint.py format rules tidy

format: build/setup/lint ## Format all C and C++ sources in place
	$(Q)python3 tools/lint.py reformat

check-symbols: lib codec ## Fail on any heap, libc or global-state symbol in library or codec
	$(Q)python3 tools/check_symbols.py --objdump $(OBJDUMP) $(BUILD)/libgpom.a
	$(Q)python3 tools/check_symbols.py --objdump $(OBJDUMP) $(BUILD)/libgpom_codec.a

firmware: build/setup/firmware ## Build library and demo image for CPU (cortex-m7, cortex-m4)
	$(Q)$(MAKE) CROSS=arm-none-eabi- CPU=$(CPU) firmware-image

test-firmware: firmware ## Run the image in QEMU: result, instruction counts, sizes, stack
	$(Q)$(MAKE) CPU=cortex-m4 firmware
	$(Q)$(RUN_TESTS) firmware

clean: ## Remove what was built, keep the installed Python environment
	$(Q)rm -rf build/host-* build/arm-none-eabi-* build/s390x-linux-gnu-*

distclean: ## Remove build/ whole
	$(Q)rm -rf build

.PHONY: help lib tools codec gpomd bench bench-insert bench-instructions count-queries demo \
        demo-lcm soak results fuzz test test-all lint format check-symbols firmware test-firmware \
        clean distclean test-programs unit tsan endian codec-tests linux-tests fuzzers \
        firmware-image FORCE
.DEFAULT_GOAL := help

# --- Behind them -------------------------------------------------------------------------------

RUN_TESTS = SEED=$(SEED) EXEC="$(EXEC)" GPOM_DATA=$(abspath $(DATA)) \
            GPOM_BUILD=$(abspath build/host-release) FUZZ_RUNS=$(FUZZ_RUNS) \
            FUZZ_SECONDS=$(FUZZ_SECONDS) python3 tests/run.py

test-programs: lib tools unit codec-tests linux-tests $(BUILD)/api_c99 build/setup/python
	$(Q)$(MAKE) CONFIG=sanitize unit codec-tests

unit: $(BUILD)/unit_tests

tsan: $(BUILD)/tsan_tests

count-queries: build/setup/firmware
	$(Q)$(MAKE) CROSS= CPU= LANES=1 FMA=0 BUILD=build/host-scalar build/host-scalar/count-queries

fuzzers: $(FUZZERS)

# Without fused operations, as on the host, so that the same scans give the same map.
BIG_ENDIAN := CROSS=s390x-linux-gnu- CPU=s390x FMA=0
endian: $(BUILD)/snapshot_bytes
	$(Q)if tools/setup endian; then \
	    $(MAKE) $(BIG_ENDIAN) build/s390x-linux-gnu-s390x/snapshot_bytes; \
	else echo "no big-endian toolchain: its test will be skipped"; fi

linux-tests: gpomd $(BUILD)/gpom-sim $(BUILD)/gpom-query $(BUILD)/library-map \
    $(BUILD)/linux_tests $(BUILD)/lcm/stamp

codec-tests: $(BUILD)/codec_tests $(BUILD)/codec-echo

firmware-image: $(BUILD)/gpom_demo.elf $(BUILD)/libgpom_codec.a build/host-release/libicount.so

build/setup/results: build/setup/python
build/setup/%: tools/setup tools/requirements.txt tools/requirements-results.txt
	$(Q)tools/setup $*

# Objects are made again when a flag changes, not only when a file does.
$(BUILD)/flags: FORCE
	@mkdir -p $(@D)
	@echo '$(CC) $(CXX) $(CORE_FLAGS) $(HOST_FLAGS)' | cmp -s - $@ || \
	    echo '$(CC) $(CXX) $(CORE_FLAGS) $(HOST_FLAGS)' > $@

$(CORE_OBJ) $(ISA_OBJ) $(TOOL_OBJ) $(TOOLS_LIB) $(TEST_OBJ) $(TSAN_OBJ) $(ENDIAN_OBJ) $(C99_OBJ) \
    $(PORT_OBJ) $(BENCH_OBJ) $(LINUX_OBJ) $(LCM_TOOL_OBJ) $(CODEC_OBJ) $(CODEC_TEST_OBJ) \
    $(CODEC_ECHO_OBJ): \
    $(BUILD)/flags | build/setup/$(if $(CROSS),$(if $(CPU:s390x=),firmware,endian),base)
$(TEST_OBJ): | build/setup/test
$(CODEC_TEST_OBJ): $(BUILD)/lcm/stamp | build/setup/test
$(LINUX_OBJ) $(LCM_TOOL_OBJ): | build/setup/lcm

define compile # compiler and flags
	@mkdir -p $(@D)
	$(if $(V),,@echo "  CC   $@")
	$(Q)$(1) -MMD -MP -c $< -o $@
endef

$(CORE_OBJ): $(BUILD)/obj/%.o: %.cpp
	$(call compile,$(CXX) $(CORE_FLAGS))
$(ISA_OBJ): $(BUILD)/obj/src/answer_%.o: src/answer.cpp
	$(call compile,$(CXX) $(CORE_FLAGS) $(ISA_$*))
$(TOOL_OBJ) $(TOOLS_LIB) $(TEST_OBJ) $(TSAN_OBJ) $(ENDIAN_OBJ) $(BENCH_OBJ) $(LINUX_OBJ) \
    $(LCM_TOOL_OBJ): $(BUILD)/obj/%.o: %.cpp
	$(call compile,$(CXX) $(HOST_FLAGS))
$(C99_OBJ): $(BUILD)/obj/%.o: %.c
	$(call compile,$(CC) $(C99_FLAGS))
$(CODEC_OBJ): $(BUILD)/obj/%.o: %.c
	$(call compile,$(CC) $(CODEC_FLAGS))
$(CODEC_TEST_OBJ) $(CODEC_ECHO_OBJ): $(BUILD)/obj/%.o: %.cpp
	$(call compile,$(CXX) $(HOST_FLAGS) -isystem $(BUILD)/lcm)
$(PORT_OBJ): $(BUILD)/obj/%.o: %.c
	$(call compile,$(CC) $(PORT_FLAGS))

$(BUILD)/libgpom.a: $(CORE_OBJ) $(ISA_OBJ)
	$(if $(V),,@echo "  AR   $@")
	$(Q)rm -f $@ && $(AR) crs $@ $^

# Linked by the C compiler: a need for the C++ runtime is a link error, not a surprise.
$(BUILD)/libgpom.so: $(CORE_OBJ) $(ISA_OBJ)
	$(if $(V),,@echo "  LD   $@")
	$(Q)$(CC) -shared -Wl,-z,defs -Wl,-soname,libgpom.so -o $@ $^ -lm
$(BUILD)/api_c99: $(C99_OBJ) $(BUILD)/libgpom.a
	$(if $(V),,@echo "  LD   $@")
	$(Q)$(CC) $(MODE) -o $@ $^ -lm

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
	$(Q)$(CC) -std=gnu99 -O2 -g -w -c $(@:.o=.c) -o $@

$(BUILD)/libgpom_codec.a: $(CODEC_OBJ)
	$(if $(V),,@echo "  AR   $@")
	$(Q)rm -f $@ && $(AR) crs $@ $^
$(BUILD)/codec_tests: $(CODEC_TEST_OBJ) $(BUILD)/obj/tests/unit/main.o $(LCM_OBJ) \
    $(BUILD)/libgpom_codec.a
	$(if $(V),,@echo "  LD   $@")
	$(Q)$(CXX) $(HOST_FLAGS) -o $@ $^ -lz
$(BUILD)/codec-echo: $(CODEC_ECHO_OBJ) $(BUILD)/obj/tests/codec/types.o $(BUILD)/libgpom_codec.a
	$(if $(V),,@echo "  LD   $@")
	$(Q)$(CXX) $(HOST_FLAGS) -o $@ $^ -lz

$(BUILD)/gpomd: $(BUILD)/obj/ports/linux/gpomd.o $(LINUX_LIB)
$(BUILD)/gpom-replay: $(BUILD)/obj/tools/gpom_replay.o \
    $(call objects,ports/linux/bus ports/linux/network tools/lib/scan_log tools/lib/text_lines)
$(BUILD)/library-map: $(BUILD)/obj/tests/linux/library_map.o $(LINUX_LIB) \
    $(call objects,tools/lib/scan_log tools/lib/text_lines)
$(BUILD)/linux_tests: $(call objects,$(wildcard tests/linux/test_*.cpp) tests/unit/main.cpp) \
    $(LINUX_LIB)
$(LCM_TOOLS): $(BUILD)/libgpom.a $(BUILD)/libgpom_codec.a
	$(if $(V),,@echo "  LD   $@")
	$(Q)$(CXX) $(HOST_FLAGS) -o $@ $(filter %.o,$^) $(filter %_codec.a,$^) $(filter %gpom.a,$^) \
	    -llcm -lz

# Fuzzers: clang compiles the codec again with libFuzzer's coverage and both sanitizers.
$(FUZZERS): build/host-fuzz/%: tests/fuzz/%.cpp tests/codec/types.cpp $(CODEC_SRC) \
    $(wildcard ports/codec/*.h tests/codec/*.hpp include/gpom/*.h) | build/setup/fuzz
	@mkdir -p $(@D)/$*_obj
	$(if $(V),,@echo "  FUZZ $@")
	$(Q)cd $(@D)/$*_obj && clang -std=c99 $(FUZZ_FLAGS) -c $(abspath $(CODEC_SRC))
	$(Q)clang++ -std=c++17 $(FUZZ_FLAGS) -o $@ $< tests/codec/types.cpp $(@D)/$*_obj/*.o -lz

.SECONDEXPANSION: # gpom-some-tool is made from tools/gpom_some_tool.cpp
$(TOOLS): $(BUILD)/%: $(BUILD)/obj/tools/$$(subst -,_,$$*).o $(TOOLS_LIB) $(BUILD)/libgpom.a
	$(if $(V),,@echo "  LD   $@")
	$(Q)$(CXX) $(HOST_FLAGS) -o $@ $^ $(TOOL_LIBS)
$(SCRIPTS): $(BUILD)/%: tools/$$(subst -,_,$$*).py build/setup/python
	@mkdir -p $(@D)
	@printf '#!/bin/sh\nexec "%s" "%s" "$$@"\n' $(abspath build/venv/bin/python) $(abspath $<) > $@
	@chmod +x $@
$(BUILD)/speed: $(BUILD)/obj/bench/speed.o $(BENCH_LIB) $(BUILD)/libgpom.a
	$(if $(V),,@echo "  LD   $@")
	$(Q)$(CXX) $(HOST_FLAGS) -o $@ $^ -lbenchmark -lz
$(BUILD)/count-queries: $(BUILD)/obj/bench/count_queries.o $(BENCH_LIB) $(BUILD)/libgpom.a
	$(if $(V),,@echo "  LD   $@")
	$(Q)$(CXX) $(HOST_FLAGS) -o $@ $^ -lz
$(BUILD)/unit_tests: $(TEST_OBJ) $(TOOLS_LIB) $(BUILD)/libgpom.a
	$(if $(V),,@echo "  LD   $@")
	$(Q)$(CXX) $(HOST_FLAGS) -o $@ $^ $(TOOL_LIBS)
$(BUILD)/snapshot_bytes: $(ENDIAN_OBJ) $(BUILD)/obj/tools/lib/snapshot_file.o $(BUILD)/libgpom.a
	$(if $(V),,@echo "  LD   $@")
	$(Q)$(CXX) $(HOST_FLAGS) $(if $(CROSS),-static) -o $@ $^
$(BUILD)/tsan_tests: $(TSAN_OBJ) $(BUILD)/libgpom.a
	$(if $(V),,@echo "  LD   $@")
	$(Q)$(CXX) $(HOST_FLAGS) -o $@ $^

$(STREET)/street.h: tools/street_header.py tools/params/street.toml tests/firmware/points.csv
	$(Q)$(MAKE) CROSS= CPU= CONFIG=release build/host-release/gpom-sim
	@mkdir -p $(@D)
	$(Q)build/host-release/gpom-sim --seed 1 --out $(STREET)/scans.csv
	$(Q)python3 tools/street_header.py $(STREET)/scans.csv tools/params/street.toml \
	    tests/firmware/points.csv $@
$(PORT_OBJ): $(STREET)/street.h

LD_SCRIPT := ports/cortex_m/mps2_an500.ld
$(BUILD)/gpom_demo.elf: $(PORT_OBJ) $(BUILD)/libgpom.a $(LD_SCRIPT)
	$(if $(V),,@echo "  LD   $@")
	$(Q)$(CC) $(CPU_FLAGS) --specs=nano.specs -nostartfiles -Wl,--gc-sections,--fatal-warnings \
	    -Wl,-Map=$(@:.elf=.map) -T $(LD_SCRIPT) -o $@ $(PORT_OBJ) $(BUILD)/libgpom.a -lm

# QEMU loads this into itself, so it is always for the host.
build/host-release/libicount.so: ports/cortex_m/icount_plugin.c | build/setup/base
	@mkdir -p $(@D)
	$(Q)cc -std=c99 -O2 $(WARN) -shared -fPIC -o $@ $<

-include $(wildcard $(BUILD)/obj/*/*.d $(BUILD)/obj/*/*/*.d)
