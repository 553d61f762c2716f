# Times and instruction counts.

BENCH_LIB := $(SCAN_LIB) $(call objects,$(patsubst %,tools/%.cpp,sim/street sim/street_drive \
             sim/street_world sim/truth map/host_map) ports/host/params_toml ports/host/toml_table)
# count_visits.cpp needs a library that counts (VISITS=1).
BENCH_SRC := $(filter-out $(if $(VISITS),,bench/count_visits.cpp),$(wildcard bench/*.cpp))
BENCH_OBJ := $(call objects,$(BENCH_SRC))
# The solve alone, compiled as the hot path is; kernel_constants() comes from the same namespace.
BENCH_ISAS := $(if $(filter auto,$(LANES)),avx2 avx512)
BENCH_ISA_OBJ := $(foreach isa,$(BENCH_ISAS),$(BUILD)/obj/bench/solve_$(isa).o \
                 $(BUILD)/obj/bench/kernel_$(isa).o)

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

bench-record: bench ## Keep the main ratios of this processor, for a column of RESULTS.md
	@mkdir -p bench/processors
	$(Q)python3 bench/ratios.py --speed build/bench/speed.json \
	    --insert build/bench/insert-of-*.json --record bench/processors

bench-insert: build/setup/bench $(BUILD)/bench-insertion
bench-insert: ## Time inserting scans into a map of 20,000 beams, one with room and a full one
	@mkdir -p build/bench
	$(Q)for beam_max in 40000 20000; do \
	    $(BUILD)/bench-insertion tools/params/street.toml $$beam_max \
	        build/bench/insert-of-$$beam_max.json || exit 1; \
	done
	$(Q)python3 bench/ratios.py --insert build/bench/insert-of-*.json

bench-distances: build/setup/bench $(BUILD)/bench-distances $(BUILD)/distance-error
bench-distances: ## Distances against dynamicEDT3D: time to keep them up, and their error
	$(Q)$(BUILD)/bench-distances tools/params/street.toml
	$(Q)if [ -f $(DATA)/intel.log.gz ]; then \
	    $(BUILD)/bench-distances tools/params/indoor.toml $(DATA)/intel.log.gz 0.1; \
	else echo "bench-distances: no $(DATA)/intel.log.gz: left out"; fi
	$(Q)$(BUILD)/distance-error tools/params/street.toml 0 5 1000

bench-instructions: count-queries ## Instructions per query, scalar, by callgrind
	$(Q)python3 tests/instructions.py --json build/bench/instructions.json

bench-rays: $(BUILD)/rays ## Rays against brute force and held-out scans, cost of gradients
	$(Q)$(BUILD)/rays tools/params/street.toml street 10000
	$(Q)$(BUILD)/rays tools/params/street_plain.toml street 10000
	$(Q)if [ -f $(DATA)/intel.log.gz ]; then \
	    $(BUILD)/rays tools/params/indoor.toml $(DATA)/intel.log.gz 10000 live; \
	else echo "bench-rays: no $(DATA)/intel.log.gz: left out"; fi

bench-visits: count-visits ## Boxes and items that searches of dense maps visit
	$(Q)python3 tests/visits.py --json build/bench/visits.json

.PHONY: bench bench-record bench-insert bench-distances bench-instructions bench-visits bench-rays
.PHONY: count-queries count-visits

count-queries: build/setup/firmware
	$(Q)$(MAKE) CROSS= CPU= LANES=1 FMA=0 BUILD=build/host-scalar build/host-scalar/count-queries

# 16 lanes on every processor: the compiler splits vectors that are too wide.
count-visits:
	$(Q)$(MAKE) CROSS= CPU= LANES=16 FMA=0 VISITS=1 BUILD=build/host-visits \
	    build/host-visits/count-visits

$(BENCH_OBJ) $(BENCH_ISA_OBJ): $(BUILD)/flags | $(COMPILER)
$(patsubst %,$(BUILD)/obj/bench/%.o,speed distances distance_error insertion): | build/setup/bench
$(BENCH_OBJ): $(BUILD)/obj/%.o: %.cpp
	$(call compile,$(CXX) $(HOST_FLAGS))
$(BENCH_ISAS:%=$(BUILD)/obj/bench/solve_%.o): $(BUILD)/obj/bench/solve_%.o: bench/solve.cpp
	$(call compile,$(CXX) $(HOST_FLAGS) $(ISA_$*))
$(BENCH_ISAS:%=$(BUILD)/obj/bench/kernel_%.o): $(BUILD)/obj/bench/kernel_%.o: src/gp/kernel.cpp
	$(call compile,$(CXX) $(HOST_FLAGS) $(ISA_$*))

$(BUILD)/speed: $(BUILD)/obj/bench/speed.o $(BUILD)/obj/bench/solve.o $(BENCH_ISA_OBJ) \
    $(BENCH_LIB) $(BUILD)/libgpom.a
	$(call link,$(CXX) $(HOST_FLAGS),-lbenchmark -lz -lbz2 $(CORE_LIBS))
$(BUILD)/bench-distances: $(BUILD)/obj/bench/distances.o $(BENCH_LIB) $(BUILD)/libgpom.a
	$(call link,$(CXX) $(HOST_FLAGS),-ldynamicedt3d -lz -lbz2 $(CORE_LIBS))
$(BUILD)/distance-error: $(BUILD)/obj/bench/distance_error.o $(BENCH_LIB) $(BUILD)/libgpom.a
	$(call link,$(CXX) $(HOST_FLAGS),-ldynamicedt3d -loctomap -loctomath -lz -lbz2 $(CORE_LIBS))
$(BUILD)/bench-insertion: $(BUILD)/obj/bench/insertion.o $(call objects,$(patsubst %,tools/%.cpp,\
    live/drive eval/protocol eval/surface eval/occupancy_grid))
$(BUILD)/rays: $(BUILD)/obj/bench/rays.o
$(BUILD)/count-queries: $(BUILD)/obj/bench/count_queries.o
$(BUILD)/bench-insertion $(BUILD)/rays $(BUILD)/count-queries: $(BENCH_LIB) $(BUILD)/libgpom.a
	$(call link,$(CXX) $(HOST_FLAGS),-lz -lbz2 $(CORE_LIBS))
$(BUILD)/count-visits: $(BUILD)/obj/bench/count_visits.o $(BENCH_LIB) $(BUILD)/libgpom.a
	$(call link,$(CXX) $(HOST_FLAGS),-lz -lbz2 $(CORE_LIBS))
