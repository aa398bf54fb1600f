"""The colours of all figures, those of Okabe and Ito: told apart by every eye, and in grey."""

BLUE, ORANGE, GREEN, VERMILLION, SKY, PURPLE = "#0072B2", "#E69F00", "#009E73", "#D55E00", "#56B4E9", "#CC79A7"
BLACK, DARK, GREY, LIGHT = "#000000", "0.30", "0.55", "0.88"
POSTERIOR, PAPER, WEIGHTED = BLUE, ORANGE, BLACK
