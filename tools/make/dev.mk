# For developers: house rules, formatting, symbols, the database of compile commands.

lint: build/setup/lint build/setup/base $(STREET)/street.h $(MAVLINK_INCLUDE)/stamp
lint: ## Check formatting, house rules and clang-tidy
	$(Q)python3 tools/dev/lint.py format rules tidy

format: build/setup/lint build/setup/base
format: ## Format all C and C++ sources in place
	$(Q)python3 tools/dev/lint.py reformat

check-symbols: $(foreach i,device can mavlink,$(BUILD)/libgpom_$(i).a)
check-symbols: lib codec ## Fail on any heap, libc or global-state symbol in library or codec
	$(Q)python3 tools/dev/check_symbols.py --objdump $(OBJDUMP) \
	    $(if $(filter 1,$(SPARSE)),--sparse) $(BUILD)/libgpom.a
	$(Q)python3 tools/dev/check_symbols.py --objdump $(OBJDUMP) $(BUILD)/libgpom_codec.a
	$(Q)python3 tools/dev/check_symbols.py --objdump $(OBJDUMP) --port $(BUILD)/libgpom_device.a
	$(Q)python3 tools/dev/check_symbols.py --objdump $(OBJDUMP) --port $(BUILD)/libgpom_mavlink.a
	$(Q)python3 tools/dev/check_symbols.py --objdump $(OBJDUMP) $(BUILD)/libgpom_can.a

# The commands of all objects in NAME_OBJ, this machine's first, then the microcontroller's.
HOST_OBJECTS = $(filter-out $(PORT_OBJ) $(TARGET_OBJ),$(filter %.o, \
    $(foreach i,$(filter %_OBJ,$(.VARIABLES)),$($(i)))))
compile_commands.json: build/setup/base
compile_commands.json: ## Write build/compile_commands.json for editors and clang-tidy
	$(Q){ $(MAKE) -n -B V=1 host-objects; \
	    $(MAKE) -n -B V=1 CROSS=arm-none-eabi- CPU=$(CPU) port-objects; } | \
	    python3 tools/dev/compile_commands.py build/compile_commands.json
host-objects: $(HOST_OBJECTS)
port-objects: $(PORT_OBJ) $(TARGET_OBJ)

.PHONY: lint format check-symbols compile_commands.json host-objects port-objects
