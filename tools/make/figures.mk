# Figures that stand in several documents.

figures: | build/setup/base ## Fill the figures that documents mark
	$(Q)python3 tools/report/figures.py

.PHONY: figures
