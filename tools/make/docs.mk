# The documentation site: docs/ and the comments of include/gpom/, into build/docs/html.

DOCS       := build/docs

docs: tools gpomd build/setup/docs ## Build the documentation site: build/docs/html/index.html
	@mkdir -p $(DOCS)
	$(if $(V),,@echo "  DOC  $(DOCS)/xml")
	$(Q)python3 tools/dev/docs_pages.py --build $(BUILD) --out $(DOCS)/generated
	$(Q)doxygen docs/Doxyfile
	$(Q)python3 tools/dev/docs_complete.py $(DOCS)/xml include/gpom/*.h
	$(if $(V),,@echo "  DOC  $(DOCS)/html")
	$(Q)sphinx-build -q -W --keep-going -d $(DOCS)/doctrees -b html docs $(DOCS)/html

.PHONY: docs

test-all: build/setup/docs
