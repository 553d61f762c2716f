# gpom-params, and the presets as C headers: #include "gpom/presets/street.h" with -I$(PRESETS).

# Of few objects, as firmware needs it before anything else: see $(PRESET_HEADERS).
PARAMS_OBJ := $(call objects,tools/gpom_params.cpp $(wildcard tools/params_tool/*.cpp) \
              ports/host/params_toml.cpp ports/host/toml_table.cpp ports/host/text_lines.cpp \
              ports/host/packed_file.cpp)
$(BUILD)/obj/tools/gpom_params.o: tools/gpom_params.cpp $(BUILD)/flags | build/setup/base
	$(call compile,$(CXX) $(HOST_FLAGS))
$(BUILD)/gpom-params: $(PARAMS_OBJ) $(BUILD)/libgpom.a
	$(call link,$(CXX) $(HOST_FLAGS),-lz -lbz2 $(CORE_LIBS))
tools: $(BUILD)/gpom-params

# Always in the host's build, whatever is built: they are the same for all.
HOST_BUILD := build/host-release
PRESETS    := $(HOST_BUILD)/include
PRESET_HEADERS := $(patsubst tools/params/%.toml,$(PRESETS)/gpom/presets/%.h,\
                  $(wildcard tools/params/*.toml))
presets: $(PRESET_HEADERS) ## Make C headers of tools/params: build/host-release/include/gpom
tools: presets
firmware lint: presets # before other makes ask for them side by side
.PHONY: presets

ifeq ($(BUILD),$(HOST_BUILD))
$(PRESET_HEADERS): $(PRESETS)/gpom/presets/%.h: tools/params/%.toml $(BUILD)/gpom-params
	@mkdir -p $(@D)
	$(if $(V),,@echo "  TOML $@")
	$(Q)$(BUILD)/gpom-params $< --to header --out $@
else
# Where they are missing or old, by a make for the host, which must not see what this one was told.
TOLD := CROSS CPU CPU_FLAGS BARE CONFIG BUILD LANES FMA MINNUM SPARSE SAN SHARED CC CXX AR CFLAGS \
        CXXFLAGS OBJDUMP
$(PRESET_HEADERS) &: $(wildcard tools/params/*.toml)
	$(Q)env $(TOLD:%=-u %) MAKEFLAGS="$${MAKEFLAGS%% -- *}" $(MAKE) presets
	$(Q)touch $(PRESET_HEADERS)
endif
