"""Reports: one HTML file that shows results in any browser, without a network.

Tables are HTML that Python writes; charts (Plotly) and drawings (a canvas) are made in the page
from data in it. `page` puts the parts together, `encoding` packs data, the folder `page` holds
style and scripts.
"""
