# Host tools: programs of C++ and of Python, and the demonstrations that run them.

TOOL_SRC  := $(filter-out $(LCM_TOOL_SRC) tools/gpom_params.cpp,$(wildcard tools/gpom_*.cpp))
TOOL_OBJ  := $(call objects,$(TOOL_SRC))
TOOL_PART_OBJ := $(call objects,$(wildcard tools/*/*.cpp))
TOOLS_LIB := $(HOST_OBJ) $(TOOL_PART_OBJ)
TOOLS     := $(subst _,-,$(TOOL_SRC:tools/%.cpp=$(BUILD)/%))
SCRIPT_SRC := $(wildcard tools/*/gpom_*.py) tools/report/exact_gp.py
SCRIPTS   := $(subst _,-,$(patsubst %.py,$(BUILD)/%,$(notdir $(SCRIPT_SRC))))
# gpom-some-script runs tools/SOME_FOLDER/gpom_some_script.py.
script_of  = $(filter %/$(subst -,_,$(1)).py,$(SCRIPT_SRC))
TOOL_LIBS  := -lz -lbz2 -loctomap -loctomath

tools: $(TOOLS) $(SCRIPTS) ## Build the host tools

results: tools build/setup/results bench ## Judge all methods, and their speed: RESULTS.md
	$(Q)$(BUILD)/gpom-results --build $(BUILD) --data $(DATA) --bench build/bench --out RESULTS.md

CARS = $(BUILD)/gpom-live cars --params tools/params/street.toml --scans 80 --keep 0.1 \
       $(if $(SEED),--seed $(SEED))
demo-cars: $(BUILD)/gpom-live build/setup/python
demo-cars: ## Vehicles leave (spurious returns or not) or arrive on a street: build/demo-cars
	@mkdir -p build/demo-cars
	$(Q)$(CARS) --cars-leave-at 40 --json build/demo-cars/leave.json
	$(Q)$(CARS) --cars-leave-at 40 --spurious 0.05 --json build/demo-cars/spurious.json
	$(Q)$(CARS) --cars-leave-at -1 --cars-arrive-at 40 --json build/demo-cars/arrive.json
	$(Q)build/venv/bin/python tools/view/cars_picture.py $(foreach i,leave spurious arrive, \
	    build/demo-cars/$i.json) --out build/demo-cars/map.png

demo-doors: $(BUILD)/gpom-live build/setup/python
demo-doors: ## Doors in a live map, a low-resolution map and OctoMap: build/demo-doors
	@mkdir -p build/demo-doors
	$(Q)$(BUILD)/gpom-live door --params tools/params/indoor.toml $(if $(SEED),--seed $(SEED)) \
	    --json build/demo-doors/doors.json
	$(Q)for stage in past through; do build/venv/bin/python tools/view/door_picture.py \
	    build/demo-doors/doors.json --stage $$stage --out build/demo-doors/$$stage.png || exit; done

SLAM_LOG ?= intel
demo-slam: $(BUILD)/gpom-slam build/setup/python
demo-slam: ## Map SLAM_LOG-raw of DATA by odometry, by alignment, corrected: build/demo-slam
	@mkdir -p build/demo-slam
	$(Q)$(BUILD)/gpom-slam drive --params tools/params/indoor.toml \
	    --scans $(DATA)/$(SLAM_LOG)-raw.log.gz --corrected $(DATA)/$(SLAM_LOG).log.gz \
	    --methods odometry,gpom,corrected --csv build/demo-slam/way.csv \
	    --points build/demo-slam/points.csv --map build/demo-slam/beams.csv
	$(Q)build/venv/bin/python tools/view/slam_picture.py --way build/demo-slam/way.csv \
	    --points build/demo-slam/points.csv --out build/demo-slam/map.png

demo: $(foreach i,sim learn eval plot,$(BUILD)/gpom-$(i))
demo: ## Simulate or replay LOG, build a map, evaluate and plot it
	$(Q)SEED=$(SEED) GPOM_BUILD=$(abspath $(BUILD)) tools/demo $(LOG)

.PHONY: tools results demo-cars demo-doors demo-slam demo

$(TOOL_OBJ) $(TOOL_PART_OBJ): $(BUILD)/flags | $(COMPILER)
$(TOOL_OBJ): $(BUILD)/obj/%.o: %.cpp
	$(call compile,$(CXX) $(BRIEF_FLAGS))
$(TOOL_PART_OBJ): $(BUILD)/obj/%.o: %.cpp
	$(call compile,$(CXX) $(HOST_FLAGS))

# gpom-some-tool is made from tools/gpom_some_tool.cpp and these folders of tools/, if not from all.
FOLDERS_gpom-sim   := sim
FOLDERS_gpom-query := map
tool_objects = $(BUILD)/obj/tools/$(subst -,_,$(1)).o $(HOST_OBJ) \
    $(if $(FOLDERS_$(1)),$(filter $(BUILD)/obj/tools/$(FOLDERS_$(1))/%,$(TOOL_PART_OBJ)), \
    $(TOOL_PART_OBJ))
$(foreach i,$(TOOLS),$(eval $(i): $(call tool_objects,$(notdir $(i)))))
$(BUILD)/gpom-odometry: $(call objects,ports/linux/pose/odometry ports/linux/pose/pose_ring)
$(TOOLS): $(BUILD)/libgpom.a
	$(call link,$(CXX) $(HOST_FLAGS),$(TOOL_LIBS) $(CORE_LIBS))
$(foreach i,$(SCRIPTS),$(eval $(i): $(call script_of,$(notdir $(i)))))
$(SCRIPTS): build/setup/python
	@mkdir -p $(@D)
	@printf '#!/bin/sh\nexec "%s" "%s" "$$@"\n' $(abspath build/venv/bin/python) \
	    $(abspath $(filter %.py,$^)) > $@
	@chmod +x $@
