# Test programs for this machine and other processors, fuzzers, the runner.

UNIT_SRC  := $(wildcard tests/common/*.cpp tests/unit/*/*.cpp tests/host/*.cpp)
TEST_OBJ  := $(call objects,$(filter-out $(if $(filter 0,$(SPARSE)),tests/unit/gp/test_sparse.cpp),\
               $(UNIT_SRC)))
# Those of the core alone, without a library that a cross compiler would lack.
CORE_TEST_OBJ := $(filter $(TEST_OBJ),$(call objects,$(shell \
    grep -L -e '"tools/' -e '"ports/' -e zlib -e snapshot_medium $(UNIT_SRC))))
# Those of the tools: a program of its own, so that `test` need not sanitize all tools.
TOOL_TEST_OBJ := $(call objects,$(wildcard tests/tools/*.cpp))
SNAPSHOT_OBJ := $(call objects,$(wildcard tests/processors/*.cpp))
TSAN_OBJ  := $(call objects,$(wildcard tests/tsan/*.cpp))
C99_OBJ   := $(call objects,$(wildcard tests/api_c99/*.c))
CODEC_TEST_SRC := $(filter-out tests/codec/codec_echo.cpp,$(wildcard tests/codec/*.cpp))
CODEC_TEST_OBJ := $(call objects,$(CODEC_TEST_SRC))
CODEC_ECHO_OBJ := $(call objects,tests/codec/codec_echo.cpp)
CAN_TEST_OBJ   := $(call objects,$(wildcard tests/can/*.cpp))
MAVLINK_TEST_OBJ := $(call objects,$(wildcard tests/mavlink/*.cpp))
LINUX_TEST_OBJ := $(call objects,$(wildcard tests/linux/test_*.cpp))
LIBRARY_MAP_OBJ := $(call objects,tests/linux/library_map.cpp)
FUZZERS   := $(patsubst tests/fuzz/%.cpp,build/host-fuzz/%,$(wildcard tests/fuzz/*.cpp))

RUN_TESTS = SEED=$(SEED) EXEC="$(EXEC)" GPOM_DATA=$(abspath $(DATA)) \
            GPOM_BUILD=$(abspath build/host-release) FUZZ_RUNS=$(FUZZ_RUNS) \
            FUZZ_SECONDS=$(FUZZ_SECONDS) python3 tests/run.py

test: test-programs ## Run the tests of library and tools (unit also under ASan and UBSan)
	$(Q)$(RUN_TESTS) --summary build/test-summary.json base

test-all: test-programs
test-all: build/setup/lint build/setup/install build/setup/can linux-tests can-tests fuzzers
test-all: count-queries count-visits test-firmware-programs python-package
test-all: ## Run `test`, campaigns, processors, firmware, CAN, fuzz, lint
	$(Q)$(MAKE) CONFIG=sanitize tool-tests \
	    $(addprefix build/host-sanitize/,gpomd linux_tests)
	$(Q)$(MAKE) CONFIG=thread tsan build/host-thread/gpomd
	$(Q)$(MAKE) processors
	$(Q)$(RUN_TESTS) --summary build/test-all-summary.json $(if $(SKIP_BASE),,base) extra

test-can: can-tests build/setup/can ## Test CAN: frames, and gpomd on vcan or in a QEMU guest
	$(Q)$(RUN_TESTS) can

fuzz: fuzzers ## Fuzz each decoder: FUZZ_RUNS inputs, or FUZZ_SECONDS
	$(Q)$(RUN_TESTS) fuzz

.PHONY: test test-all test-can fuzz test-programs unit tool-tests tsan codec-tests linux-tests \
        can-tests fuzzers processors

test-programs: lib tools unit tool-tests codec-tests linux-tests $(BUILD)/api_c99 \
    $(BUILD)/template_test build/setup/python
	$(Q)$(MAKE) CONFIG=sanitize unit codec-tests \
	    $(addprefix build/host-sanitize/,template_test mavlink_tests)

unit: $(BUILD)/unit_tests

tool-tests: $(BUILD)/tool_tests

tsan: $(BUILD)/tsan_tests

codec-tests: $(BUILD)/codec_tests $(BUILD)/codec-echo

linux-tests: gpomd $(BUILD)/mavlink_tests $(BUILD)/libgpom_mavlink.so $(BUILD)/gpom-sim \
    $(BUILD)/gpom-query $(BUILD)/library-map $(BUILD)/linux_tests $(BUILD)/lcm/stamp

can-tests: gpomd $(BUILD)/can_tests $(BUILD)/libgpom_can.so $(BUILD)/gpom-sim $(BUILD)/lcm/stamp \
    $(BUILD)/linux_tests
	$(Q)$(MAKE) CONFIG=sanitize build/host-sanitize/can_tests

fuzzers: $(FUZZERS)

# None with fused operations, as the host's, so that the same scans give the same map.
ARM64      := CROSS=aarch64-linux-gnu- CPU=armv8-a LANES=4 FMA=0
BIG_ENDIAN := CROSS=s390x-linux-gnu- CPU=s390x LANES=1 FMA=0
processors: $(BUILD)/snapshot_bytes ## Build tests for 64-bit Arm and a big-endian processor
	$(Q)tools/setup processors || { rm -f build/setup/processors; \
	    echo "no cross compilers: tests on other processors will be skipped"; }
	$(Q)if [ -e build/setup/processors ]; then \
	    $(MAKE) $(ARM64) $(addprefix build/aarch64-linux-gnu-armv8-a/,snapshot_bytes \
	        core_tests api_c99) && \
	    $(MAKE) $(BIG_ENDIAN) build/s390x-linux-gnu-s390x/snapshot_bytes; fi

$(TEST_OBJ) $(TOOL_TEST_OBJ) $(SNAPSHOT_OBJ) $(TSAN_OBJ) $(C99_OBJ) $(CODEC_TEST_OBJ) \
    $(CODEC_ECHO_OBJ) $(CAN_TEST_OBJ) $(MAVLINK_TEST_OBJ) $(LINUX_TEST_OBJ) $(LIBRARY_MAP_OBJ): \
    $(BUILD)/flags | $(COMPILER)
$(TEST_OBJ): | build/setup/test $(if $(CROSS),$(CROSS_INCLUDE)/stamp)
$(CODEC_TEST_OBJ): $(BUILD)/lcm/stamp | build/setup/test
$(TOOL_TEST_OBJ) $(CAN_TEST_OBJ) $(MAVLINK_TEST_OBJ) $(LINUX_TEST_OBJ): | build/setup/test
$(TEST_OBJ) $(TOOL_TEST_OBJ) $(CAN_TEST_OBJ) $(MAVLINK_TEST_OBJ) $(LINUX_TEST_OBJ) \
    $(LIBRARY_MAP_OBJ): $(BUILD)/obj/%.o: %.cpp
	$(call compile,$(CXX) $(BRIEF_FLAGS))
$(SNAPSHOT_OBJ) $(TSAN_OBJ): $(BUILD)/obj/%.o: %.cpp
	$(call compile,$(CXX) $(HOST_FLAGS))
$(C99_OBJ): $(BUILD)/obj/%.o: %.c
	$(call compile,$(CC) $(C99_FLAGS))
$(CODEC_TEST_OBJ) $(CODEC_ECHO_OBJ): $(BUILD)/obj/%.o: %.cpp
	$(call compile,$(CXX) $(BRIEF_FLAGS) -isystem $(BUILD)/lcm)

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
$(LCM_OBJ): $(BUILD)/lcm/stamp | $(COMPILER) $(if $(CROSS),$(CROSS_INCLUDE)/stamp)
	$(call compile,$(CC) $(CPU_FLAGS) $(if $(CROSS),-isystem $(CROSS_INCLUDE)) -std=gnu99 \
	    -O2 -g -w,$(@:.o=.c))

# A cross compiler does not look where these headers are.
$(CROSS_INCLUDE)/stamp: | build/setup/test build/setup/lcm
	$(Q)mkdir -p $(@D) && ln -sfn /usr/include/doctest /usr/include/lcm $(@D) && touch $@

$(BUILD)/api_c99: $(C99_OBJ) $(BUILD)/libgpom.a
	$(call link,$(CC) $(MODE) $(if $(CROSS),-static),$(CORE_LIBS))
$(BUILD)/unit_tests: $(TEST_OBJ) $(HOST_OBJ) $(call objects,tools/sim/truth.cpp) $(BUILD)/libgpom.a
	$(call link,$(CXX) $(HOST_FLAGS),-lz -lbz2 $(CORE_LIBS))
$(BUILD)/tool_tests: $(TOOL_TEST_OBJ) $(BUILD)/obj/tests/common/main.o $(TOOLS_LIB) \
    $(BUILD)/libgpom.a
	$(call link,$(CXX) $(HOST_FLAGS),$(TOOL_LIBS) $(CORE_LIBS))
$(BUILD)/core_tests: $(CORE_TEST_OBJ) $(BUILD)/libgpom.a
	$(call link,$(CXX) $(HOST_FLAGS) -static,$(CORE_LIBS))
$(BUILD)/snapshot_bytes: $(SNAPSHOT_OBJ) $(BUILD)/obj/ports/host/snapshot_file.o $(BUILD)/libgpom.a
	$(call link,$(CXX) $(HOST_FLAGS) $(if $(CROSS),-static),$(CORE_LIBS))
$(BUILD)/tsan_tests: $(TSAN_OBJ) $(BUILD)/libgpom.a
	$(call link,$(CXX) $(HOST_FLAGS),$(CORE_LIBS))
$(BUILD)/codec_tests: $(CODEC_TEST_OBJ) $(BUILD)/obj/tests/common/main.o $(LCM_OBJ) \
    $(BUILD)/libgpom_device.a $(BUILD)/libgpom_codec.a
	$(call link,$(CXX) $(HOST_FLAGS),-lz)
$(BUILD)/codec-echo: $(CODEC_ECHO_OBJ) $(BUILD)/obj/tests/codec/types.o $(BUILD)/libgpom_codec.a
	$(call link,$(CXX) $(HOST_FLAGS),-lz)
$(BUILD)/can_tests: $(CAN_TEST_OBJ) $(BUILD)/obj/tests/common/main.o $(BUILD)/libgpom_can.a
	$(call link,$(CXX) $(HOST_FLAGS))
$(BUILD)/mavlink_tests: $(MAVLINK_TEST_OBJ) $(BUILD)/obj/tests/common/main.o \
    $(BUILD)/libgpom_mavlink.a $(BUILD)/libgpom_device.a $(BUILD)/libgpom_codec.a $(BUILD)/libgpom.a
	$(call link,$(CXX) $(HOST_FLAGS),$(CORE_LIBS))
# For tests by ctypes: all that is hidden in the library is open here.
$(BUILD)/libgpom_can.so: $(CAN_SRC) $(wildcard ports/can/*.h ports/can/examples/*.h) | $(COMPILER)
	$(call link,$(CC) -std=c99 -pedantic-errors -shared -O2 -fPIC $(WARN) $(INCLUDES),$(CAN_SRC))
$(BUILD)/libgpom_mavlink.so: ports/mavlink/messages.c ports/mavlink/messages.h | \
    $(COMPILER) $(MAVLINK_INCLUDE)/stamp
	$(call link,$(CC) -std=c99 -pedantic-errors -shared -O2 -fPIC $(WARN) $(INCLUDES) \
	    -isystem $(MAVLINK_INCLUDE),$<)
$(BUILD)/library-map: $(LIBRARY_MAP_OBJ) $(LINUX_LIB) $(SCAN_LIB)
$(BUILD)/linux_tests: $(LINUX_TEST_OBJ) $(BUILD)/obj/tests/common/main.o $(LINUX_LIB)
$(BUILD)/library-map $(BUILD)/linux_tests: $(BUILD)/libgpom.a $(BUILD)/libgpom_codec.a \
    $(BUILD)/libgpom_can.a $(BUILD)/libgpom_mavlink.a
	$(call link,$(CXX) $(HOST_FLAGS),-lz -lbz2 $(CORE_LIBS))

# Fuzzers: clang compiles the codec again with libFuzzer's coverage and both sanitizers.
FUZZ_FLAGS := -O1 -g -fsanitize=fuzzer,address,undefined -fno-sanitize-recover=all -Iinclude -I.
fuzz_objects = $(patsubst %,build/host-fuzz/obj/%.o,$(basename $(1)))
FUZZED_OBJ := $(call fuzz_objects,$(CODEC_SRC) $(CAN_SRC) ports/uart/frame.c)
FUZZER_OBJ := $(call fuzz_objects,tests/codec/types.cpp $(wildcard tests/fuzz/*.cpp))
$(FUZZED_OBJ) $(FUZZER_OBJ): | build/setup/fuzz build/setup/base
$(FUZZED_OBJ): build/host-fuzz/obj/%.o: %.c
	$(call compile,clang -std=c99 $(FUZZ_FLAGS))
$(FUZZER_OBJ): build/host-fuzz/obj/%.o: %.cpp
	$(call compile,clang++ -std=c++17 $(FUZZ_FLAGS))
$(FUZZERS): build/host-fuzz/%: build/host-fuzz/obj/tests/fuzz/%.o \
    build/host-fuzz/obj/tests/codec/types.o $(FUZZED_OBJ)
	$(call link,clang++ $(FUZZ_FLAGS),-lz)
