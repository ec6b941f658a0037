"""Reports: one HTML file that shows results in any browser, without a network.

Tables are documents, those of the terminal, which `html` writes; charts (Plotly) and drawings (a
canvas) are made in the page from data in it. `page` puts the parts together, the folder `page`
holds style and scripts.
"""
