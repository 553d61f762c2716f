# How every part compiles, links, archives and installs what it needs.

objects = $(patsubst %,$(BUILD)/obj/%.o,$(basename $(1)))

define compile # compiler and flags; source, if not the first prerequisite
	@mkdir -p $(@D)
	$(if $(V),,@echo "  CC   $@")
	$(Q)$(1) -MMD -MP -c $(or $(2),$<) -o $@
endef

# Archives follow the objects, each before those that it needs.
link_inputs = $(filter %.o,$^) $(filter %_device.a,$^) $(filter %_codec.a %_can.a,$^) \
              $(filter %/libgpom.a,$^)
define link # compiler and flags; libraries, or sources to compile and link at once
	@mkdir -p $(@D)
	$(if $(V),,@echo "  LD   $@")
	$(Q)$(1) -o $@ $(link_inputs) $(2)
endef

define archive
	$(if $(V),,@echo "  AR   $@")
	$(Q)rm -f $@ && $(AR) crs $@ $^
endef

# What an object needs before its compiler runs: the group of tools/setup that has the compiler.
COMPILER := build/setup/$(if $(CROSS),$(if $(filter 1,$(BARE)),firmware,processors),base)

build/setup/results build/setup/can: build/setup/python
build/setup/%: tools/setup tools/requirements.txt tools/requirements-results.txt \
    tools/requirements-can.txt
	$(Q)tools/setup $*

# Objects are made again when a flag changes, not only when a file does.
$(BUILD)/flags: FORCE
	@mkdir -p $(@D)
	@echo '$(CC) $(CXX) $(CORE_FLAGS) $(HOST_FLAGS)' | cmp -s - $@ || \
	    echo '$(CC) $(CXX) $(CORE_FLAGS) $(HOST_FLAGS)' > $@
.PHONY: FORCE

-include $(wildcard $(foreach i,obj target,$(BUILD)/$(i)/*/*.d $(BUILD)/$(i)/*/*/*.d \
    $(BUILD)/$(i)/*/*/*/*.d))
