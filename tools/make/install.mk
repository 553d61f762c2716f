# Installing the library, and removing what was built.

# Of Python only what draws: it runs with the user's Python, not with build/venv.
INSTALLED = $(if $(filter 1,$(PROGRAMS)),$(TOOLS) \
            $(addprefix $(BUILD)/,gpom-params gpomd gpom-replay gpom-bridge))
install: lib presets $(INSTALLED) ## Install library, presets, programs: PREFIX, DESTDIR, SHARED=0
	$(Q)BUILD=$(BUILD) PREFIX="$(PREFIX)" DESTDIR="$(DESTDIR)" SYSCONFDIR="$(SYSCONFDIR)" \
	    PRESETS=$(PRESETS)/gpom/presets SHARED=$(SHARED) PROGRAMS="$(INSTALLED)" \
	    LIBRARIES="$(strip $(CORE_LIBS))" tools/install/install

clean: ## Remove what was built, keep the installed Python environment
	$(Q)rm -rf build/host-* build/arm-none-eabi-* build/aarch64-linux-gnu-* build/s390x-linux-gnu-*

distclean: ## Remove build/ whole
	$(Q)rm -rf build

.PHONY: install clean distclean
