"""Reports: one HTML file that shows results in any browser, without a network.

Tables are documents, those of the terminal, which `html` writes. Charts (Plotly) and drawings (a
canvas) of runs are made in the page from data in it; those of studies are pictures in SVG. `page`
puts the parts together; its folder holds style and scripts.
"""
