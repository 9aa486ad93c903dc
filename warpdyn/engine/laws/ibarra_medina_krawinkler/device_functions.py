"""Table of the device functions of all laws of Ibarra, Medina and Krawinkler."""

from warpdyn.engine.laws.ibarra_medina_krawinkler import bilinear_rules, peak_oriented_rules

SPRINGS = bilinear_rules.SPRINGS | peak_oriented_rules.SPRINGS
