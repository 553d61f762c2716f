# Figures that stand in several documents.

figures: ## Fill the figures that documents mark from RESULTS.md, budgets and what is built
	$(Q)python3 tools/report/figures.py

.PHONY: figures
