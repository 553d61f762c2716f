# Images for a Cortex-M in QEMU: demo, costs, device, template, and the unit tests.

PORT_OBJ  := $(call objects,$(filter-out %_plugin.c,$(wildcard ports/cortex_m/*.c)))

firmware: build/setup/firmware ## Build library and images for CPU (cortex-m7, cortex-m4)
	$(Q)$(MAKE) CROSS=arm-none-eabi- CPU=$(CPU) firmware-image

test-firmware: test-firmware-programs ## Run the images in QEMU: results, counts, sizes, stack
	$(Q)$(RUN_TESTS) firmware

demo-firmware: firmware firmware-host ## A street over LCM and a UART into QEMU: build/demo-firmware
	$(Q)GPOM_BUILD=$(abspath $(BUILD)) tools/demo_firmware

.PHONY: firmware test-firmware demo-firmware firmware-host firmware-image test-firmware-programs

# The PC's scalar path: one lane, multiply-adds fused, as on the microcontroller.
FUSED := build/host-fused
firmware-host: gpomd $(BUILD)/gpom-query build/setup/python
	$(Q)$(MAKE) CROSS= CPU= CONFIG=release LANES=1 FMA=1 BUILD=$(FUSED) $(FUSED)/gpom-query \
	    $(FUSED)/library-map

test-firmware-programs: firmware firmware-host
	$(Q)$(MAKE) CROSS=arm-none-eabi- CPU=cortex-m7 build/arm-none-eabi-cortex-m7/target_tests.elf
	$(Q)$(MAKE) CPU=cortex-m4 firmware

firmware-image: $(foreach i,demo costs device mavlink template,$(BUILD)/gpom_$(i).elf) \
    $(BUILD)/libgpom_can.a build/host-release/libicount.so
	$(Q)tests/firmware/budget.py $(CPU)

$(STREET)/street.h: tools/dev/street_header.py tests/firmware/scans.csv \
    tests/firmware/points.csv | build/setup/base
	@mkdir -p $(@D)
	$(Q)python3 tools/dev/street_header.py tests/firmware/scans.csv tests/firmware/points.csv $@
$(PORT_OBJ): $(BUILD)/flags $(STREET)/street.h | $(COMPILER) presets
$(PORT_OBJ): $(BUILD)/obj/%.o: %.c
	$(call compile,$(CC) $(PORT_FLAGS))

LD_SCRIPT := ports/cortex_m/mps2_an500.ld
CORTEX_M := $(BUILD)/obj/ports/cortex_m
$(BUILD)/gpom_demo.elf: $(CORTEX_M)/main.o
$(BUILD)/gpom_costs.elf: $(CORTEX_M)/costs.o $(BUILD)/libgpom_mavlink.a
$(BUILD)/gpom_device.elf: $(CORTEX_M)/device_main.o $(CORTEX_M)/mps2.o $(BUILD)/libgpom_device.a \
    $(BUILD)/libgpom_codec.a
# The same with an autopilot at a second UART.
$(CORTEX_M)/mavlink_main.o: ports/cortex_m/device_main.c $(BUILD)/flags $(STREET)/street.h | \
    $(COMPILER) presets
	$(call compile,$(CC) $(PORT_FLAGS) -DDEVICE_MAVLINK=1)
$(BUILD)/gpom_mavlink.elf: $(CORTEX_M)/mavlink_main.o $(CORTEX_M)/mps2.o \
    $(BUILD)/libgpom_mavlink.a $(BUILD)/libgpom_device.a $(BUILD)/libgpom_codec.a
$(BUILD)/gpom_template.elf: $(call objects,ports/template/main.c ports/template/port.c) \
    $(BUILD)/libgpom_device.a $(BUILD)/libgpom_codec.a
IMAGE_FLAGS := $(CPU_FLAGS) --specs=nano.specs -nostartfiles \
    -Wl,--gc-sections,--fatal-warnings
$(BUILD)/%.elf: $(CORTEX_M)/startup.o $(BUILD)/libgpom.a $(LD_SCRIPT)
	$(call link,$(CC) $(IMAGE_FLAGS) -Wl$(comma)-Map=$(@:.elf=.map) -T $(LD_SCRIPT),-lm)

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
TARGET_LINK := $(CPU_FLAGS) --specs=rdimon.specs -Wl,--gc-sections
$(TARGET_OBJ): $(BUILD)/flags $(BUILD)/lcm/stamp | $(COMPILER) $(CROSS_INCLUDE)/stamp
$(filter-out %/boot.o,$(TARGET_OBJ)): $(BUILD)/target/%.o: %.cpp
	$(call compile,$(CXX) -std=c++17 $(TARGET_FLAGS) $(TARGET_DOCTEST))
$(BUILD)/target/tests/firmware/target/boot.o: tests/firmware/target/boot.c
	$(call compile,$(CC) -std=c99 $(TARGET_FLAGS))
$(BUILD)/target_tests.elf: $(TARGET_OBJ) $(LCM_OBJ) $(BUILD)/libgpom_device.a \
    $(BUILD)/libgpom_codec.a $(BUILD)/libgpom.a tests/firmware/target/tests.ld
	$(call link,$(CXX) $(TARGET_LINK) -T $(filter %.ld,$^),-lm)

# QEMU loads this into itself, so it is always for the host.
PLUGIN_OBJ := build/host-release/obj/ports/cortex_m/icount_plugin.o
PLUGIN_FLAGS := -std=c99 -O2 $(WARN) -fPIC
$(PLUGIN_OBJ): ports/cortex_m/icount_plugin.c | build/setup/base
	$(call compile,cc $(PLUGIN_FLAGS))
build/host-release/libicount.so: $(PLUGIN_OBJ)
	$(call link,cc $(PLUGIN_FLAGS) -shared)
