# The library: src/ into libgpom.a and libgpom.so.

CORE_OBJ  := $(call objects,$(filter-out $(if $(filter 0,$(SPARSE)),src/gp/sparse_gp.cpp),\
                $(wildcard src/*/*.cpp)))
# What every program with the library in it is linked with.
CORE_LIBS := $(if $(filter 1,$(SPARSE)),-lldl -lamd) -lm
# The hot path once more for each instruction set, in a namespace of its own.
ISA_avx2   := -Dgpom=gpom_avx2 -UGPOM_LANES -DGPOM_LANES=8 -UGPOM_FMA -DGPOM_FMA=1 -mavx2 -mfma
ISA_avx512 := -Dgpom=gpom_avx512 -UGPOM_LANES -DGPOM_LANES=16 -UGPOM_FMA -DGPOM_FMA=1 \
              -mavx512f -mavx512vl -mavx512bw -mavx512dq
ISA_OBJ    := $(if $(filter auto,$(LANES)),$(foreach isa,avx2 avx512,\
              $(BUILD)/obj/src/query/answer_$(isa).o $(BUILD)/obj/src/query/gradient_$(isa).o))

lib: $(BUILD)/libgpom.a $(if $(filter 1,$(SHARED)),$(BUILD)/libgpom.so) ## Build the library

.PHONY: lib

# On a microcontroller what runs seldom, or is short, is compiled for size; on the smallest one also
# what costs few instructions for its bytes.
SMALL_cortex-m4 := insert/known_free insert/witness
SMALL := $(if $(filter 1,$(BARE)),map/config_check beams/index gp/kernel insert/forget \
    insert/keep map/map map/origin map/store raster/lowres refresh/live refresh/lowres_read \
    refresh/lowres_step $(SMALL_$(CPU)))
$(SMALL:%=$(BUILD)/obj/src/%.o): SIZE := -Os
$(CORE_OBJ) $(ISA_OBJ): $(BUILD)/flags | $(COMPILER)
$(CORE_OBJ): $(BUILD)/obj/%.o: %.cpp
	$(call compile,$(CXX) $(CORE_FLAGS) $(SIZE))
$(filter %/answer_avx2.o %/answer_avx512.o,$(ISA_OBJ)): \
    $(BUILD)/obj/src/query/answer_%.o: src/query/answer.cpp
	$(call compile,$(CXX) $(CORE_FLAGS) $(ISA_$*))
$(filter %/gradient_avx2.o %/gradient_avx512.o,$(ISA_OBJ)): \
    $(BUILD)/obj/src/query/gradient_%.o: src/query/gradient.cpp
	$(call compile,$(CXX) $(CORE_FLAGS) $(ISA_$*))

$(BUILD)/libgpom.a: $(CORE_OBJ) $(ISA_OBJ)
	$(archive)

MAJOR := $(shell sed -n 's/^.define GPOM_VERSION_MAJOR //p' include/gpom/status.h)
# Linked by the C compiler: a need for the C++ runtime is a link error, not a surprise.
$(BUILD)/libgpom.so: $(CORE_OBJ) $(ISA_OBJ)
	$(call link,$(CC) -shared -Wl$(comma)-z$(comma)defs \
	    -Wl$(comma)-soname$(comma)libgpom.so.$(MAJOR),$(CORE_LIBS))
