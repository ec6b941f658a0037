"""Reports: one HTML file that shows results in any browser, without a network.

Tables are documents, those of the terminal, which `html` writes; it puts the parts of a page
together. Charts are figures of Plotly, the drawing of a mechanism is SVG: both are made here, and
the one script of the page moves what changes with the time of its clock. The folder `page` holds
style and script.
"""
