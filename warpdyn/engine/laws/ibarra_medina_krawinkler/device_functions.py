"""The rows of Ibarra's, Medina's and Krawinkler's laws."""

from warpdyn.engine.laws.ibarra_medina_krawinkler import bilinear_rules, peak_oriented_rules

SPRINGS = bilinear_rules.SPRINGS | peak_oriented_rules.SPRINGS
