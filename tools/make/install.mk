# Installing the library, and removing what was built.

install: lib ## Install headers, libraries, pkg-config file, CMake package: PREFIX, DESTDIR
	$(Q)tools/install/install $(BUILD) "$(DESTDIR)$(PREFIX)" "$(CORE_LIBS)"

clean: ## Remove what was built, keep the installed Python environment
	$(Q)rm -rf build/host-* build/arm-none-eabi-* build/aarch64-linux-gnu-* build/s390x-linux-gnu-*

distclean: ## Remove build/ whole
	$(Q)rm -rf build

.PHONY: install clean distclean
