# The Python package gpom. CMake builds its extension (ports/python/CMakeLists.txt) with the
# archives of this file.

# What the extension links of the tools and of the readers of files.
$(BUILD)/libgpom_python_parts.a: $(TOOLS_LIB)
	$(archive)

python-parts: $(BUILD)/libgpom_python_parts.a $(BUILD)/libgpom.a

python-libraries: # SuiteSparse (LGPL) and OctoMap stay shared libraries
	@echo $(TOOL_LIBS) $(CORE_LIBS)

PYTHON := build/venv/bin/python
PYTHON_SRC := $(foreach i,gpom gpom/io src .,$(wildcard $(addprefix ports/python/$i/*,\
                .py .hpp .cpp .txt)))
# Without isolation: all that building needs is in build/venv, with pinned versions.
wheel: build/setup/package ## Build the Python package: wheel and sdist in build/wheel
	$(Q)rm -rf build/wheel && mkdir -p build/wheel
	$(Q)$(PYTHON) -m pip --quiet wheel . --no-deps --no-build-isolation -w build/wheel
	$(Q)$(PYTHON) -c "import scikit_build_core.build as b; b.build_sdist('build/wheel')"

# The package in build/venv, for tests and examples.
python-package: $(BUILD)/python-package
$(BUILD)/python-package: build/setup/package pyproject.toml $(PYTHON_SRC)
$(BUILD)/python-package: $(BUILD)/libgpom_python_parts.a $(BUILD)/libgpom.a
	$(Q)$(PYTHON) -m pip --quiet --disable-pip-version-check install --no-build-isolation .
	$(Q)touch $@

.PHONY: python-parts python-libraries wheel python-package
