# Ports to hosts: the LCM codec, devices behind a UART, CAN, MAVLink, the template, gpomd.

CODEC_SRC := $(wildcard ports/codec/*.c)
CODEC_OBJ := $(call objects,$(CODEC_SRC))
UART_OBJ  := $(call objects,$(wildcard ports/uart/*.c))
# CAN: frames and the example, C99 as the codec.
CAN_SRC   := $(wildcard ports/can/*.c ports/can/examples/*.c)
CAN_OBJ   := $(call objects,$(CAN_SRC))
# MAVLink: C99 on the headers that pymavlink's mavgen writes from its message definitions.
MAVLINK_OBJ := $(call objects,$(wildcard ports/mavlink/*.c))
MAVLINK_INCLUDE := build/mavlink
TEMPLATE_OBJ := $(call objects,$(wildcard ports/template/*.c))
# The daemon; what it shares with the tools are the readers of files.
LINUX_OBJ := $(call objects,$(wildcard ports/linux/*.cpp ports/linux/*/*.cpp))
LINUX_LIB := $(filter-out %/gpomd.o,$(LINUX_OBJ)) \
             $(call objects,$(addprefix ports/host/,params_toml toml_table snapshot_file \
               serial_port))
LCM_TOOL_SRC := tools/gpom_replay.cpp tools/gpom_bridge.cpp # built of the daemon's parts
LCM_TOOL_OBJ := $(call objects,$(LCM_TOOL_SRC))
LCM_TOOLS := $(BUILD)/gpomd $(BUILD)/gpom-replay $(BUILD)/gpom-bridge
# What the ports and the tools share, and of it the readers of recorded scans.
HOST_OBJ  := $(call objects,$(wildcard ports/host/*.cpp))
SCAN_LIB  := $(call objects,$(patsubst %,ports/host/%.cpp,scan_log carmen_log scan_times \
             laser_angles text_lines packed_file))

codec: $(BUILD)/libgpom_codec.a ## Build the LCM codec (ports/codec; with CROSS= for firmware)

gpomd: $(BUILD)/gpom-bridge
gpomd: $(BUILD)/gpomd $(BUILD)/gpom-replay $(BUILD)/gpom-watch ## Build LCM daemon and its tools

demo-lcm: build/setup/lcm
demo-lcm: $(foreach i,gpomd gpom-replay gpom-watch gpom-sim gpom-query,$(BUILD)/$(i))
demo-lcm: ## Replay a street or LOG into gpomd, compare
	$(Q)SEED=$(SEED) GPOM_BUILD=$(abspath $(BUILD)) tools/demo_lcm $(LOG)

soak: gpomd $(BUILD)/gpom-sim ## Load gpomd for SOAK_S seconds, kill it KILLS times
	$(Q)GPOM_BUILD=$(abspath $(BUILD)) GPOM_SOAK_S=$(SOAK_S) GPOM_KILLS=$(KILLS) \
	    build/venv/bin/python -m pytest -q -s -p no:cacheprovider tests/linux/test_endurance.py

.PHONY: codec gpomd demo-lcm soak

$(CODEC_OBJ) $(UART_OBJ) $(CAN_OBJ) $(MAVLINK_OBJ) $(TEMPLATE_OBJ) $(HOST_OBJ) $(LINUX_OBJ) \
    $(LCM_TOOL_OBJ): $(BUILD)/flags | $(COMPILER)
$(CODEC_OBJ) $(UART_OBJ) $(CAN_OBJ): $(BUILD)/obj/%.o: %.c
	$(call compile,$(CC) $(CODEC_FLAGS))
$(MAVLINK_OBJ): | $(MAVLINK_INCLUDE)/stamp
$(MAVLINK_OBJ): $(BUILD)/obj/%.o: %.c
	$(call compile,$(CC) $(CODEC_FLAGS) -isystem $(MAVLINK_INCLUDE))
$(TEMPLATE_OBJ): $(BUILD)/obj/%.o: %.c
	$(call compile,$(CC) $(C99_FLAGS))
$(HOST_OBJ) $(LINUX_OBJ): $(BUILD)/obj/%.o: %.cpp
	$(call compile,$(CXX) $(HOST_FLAGS))
$(LCM_TOOL_OBJ): $(BUILD)/obj/%.o: %.cpp
	$(call compile,$(CXX) $(BRIEF_FLAGS))

$(BUILD)/libgpom_codec.a: $(CODEC_OBJ)
$(BUILD)/libgpom_device.a: $(UART_OBJ)
$(BUILD)/libgpom_can.a: $(CAN_OBJ)
$(BUILD)/libgpom_mavlink.a: $(MAVLINK_OBJ)
$(foreach i,codec device can mavlink,$(BUILD)/libgpom_$(i).a):
	$(archive)

$(MAVLINK_INCLUDE)/stamp: tools/requirements-mavlink.txt | build/setup/mavlink
	$(if $(V),,@echo "  MAV  $(@D)")
	$(Q)rm -rf $(@D) && mkdir -p $(@D)
	$(Q)cd $(@D) && ../venv/bin/python -m pymavlink.tools.mavgen --lang C --wire-protocol 2.0 \
	    --output . $$(../venv/bin/python -c 'import pymavlink; print(pymavlink.__path__[0])'\
	    )/dialects/v20/common.xml > mavgen.log || { cat mavgen.log; exit 1; }
	$(Q)touch $@

# The template's program does nothing for ever: that it links is all.
$(BUILD)/template $(BUILD)/template_test: $(BUILD)/obj/ports/template/port.o \
    $(BUILD)/libgpom_device.a $(BUILD)/libgpom_codec.a $(BUILD)/libgpom.a
$(BUILD)/template: $(BUILD)/obj/ports/template/main.o
$(BUILD)/template_test: $(BUILD)/obj/ports/template/host_test.o | $(BUILD)/template
$(BUILD)/template $(BUILD)/template_test:
	$(call link,$(CC) $(MODE),$(CORE_LIBS))

$(BUILD)/gpomd: $(BUILD)/obj/ports/linux/gpomd.o $(LINUX_LIB)
$(BUILD)/gpom-replay: $(BUILD)/obj/tools/gpom_replay.o \
    $(call objects,ports/linux/lcm/sender ports/linux/base/network ports/host/lcm_log) $(SCAN_LIB)
$(BUILD)/gpom-replay: READ_LIBS := -lbz2
$(BUILD)/gpom-bridge: $(call objects,tools/gpom_bridge ports/host/serial_line \
    ports/host/serial_port \
    $(addprefix ports/linux/,lcm/sender lcm/subscriber base/memory base/network)) \
    $(BUILD)/libgpom_device.a
$(BUILD)/gpomd: $(BUILD)/libgpom_mavlink.a
$(LCM_TOOLS): $(BUILD)/libgpom.a $(BUILD)/libgpom_codec.a $(BUILD)/libgpom_can.a
	$(call link,$(CXX) $(HOST_FLAGS),-lz $(READ_LIBS) $(CORE_LIBS))
