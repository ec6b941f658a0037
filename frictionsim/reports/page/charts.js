"use strict";
// Charts over time by Plotly.
