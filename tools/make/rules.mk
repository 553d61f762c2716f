# How every part compiles, links, archives and installs what it needs.

objects = $(patsubst %,$(BUILD)/obj/%.o,$(basename $(1)))

# [n/m]: objects that this make compiles, so far of all. A dry run counts them when the first one
# begins: a make with nothing to compile does not pay for it. V=1 shows the commands instead.
started :=
COUNT_OBJECTS = env -u MAKEFLAGS -u MFLAGS -u MAKELEVEL $(firstword $(MAKE)) -n -j1 \
    $(if $(findstring B,$(firstword -$(MAKEFLAGS))),-B) $(MAKEOVERRIDES) MAKE=: n_to_compile=0 \
    $(MAKECMDGOALS) 2>/dev/null | grep -c -e ' -MMD -MP -c '
n_to_compile = $(eval n_to_compile := $(shell $(COUNT_OBJECTS)))$(n_to_compile)
progress = $(eval started += x)[$(words $(started))/$(n_to_compile)]

define compile # compiler and flags; source, if not the first prerequisite
	@mkdir -p $(@D)
	$(if $(V),,@echo "  CC   $(progress) $@")
	$(Q)$(1) -MMD -MP -c $(or $(2),$<) -o $@
endef

# Archives follow the objects, each before those that it needs.
link_inputs = $(filter %.o,$^) $(filter %_mavlink.a,$^) $(filter %_device.a,$^) \
              $(filter %_codec.a %_can.a,$^) \
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

# What tools/setup installs before anything is compiled: headers, and the cross compiler if any.
COMPILER := build/setup/base \
    $(if $(CROSS),build/setup/$(if $(filter 1,$(BARE)),firmware,processors))

build/setup/results build/setup/can build/setup/package build/setup/mavlink: build/setup/python
build/setup/package: build/setup/base
build/setup/%: tools/setup $(wildcard tools/requirements*.txt)
	$(Q)tools/setup $*

# Objects are made again when a flag changes, not only when a file does.
FLAGS := $(CC) $(CXX) $(CORE_FLAGS) $(HOST_FLAGS)
ifneq ($(strip $(file <$(BUILD)/flags)),$(strip $(FLAGS)))
$(BUILD)/flags: FORCE
endif
$(BUILD)/flags:
	@mkdir -p $(@D)
	@echo '$(FLAGS)' > $@
.PHONY: FORCE

-include $(wildcard $(foreach i,$(BUILD)/obj $(BUILD)/target build/host-fuzz/obj,$(i)/*/*.d \
    $(i)/*/*/*.d $(i)/*/*/*/*.d))
