"""Terms used by testing machines, in five languages.

Case and accents do not matter. A term stands for one or more whole words, ``-kraft`` for the end
of a word, as in German compounds, ``~力`` for anything that contains it, and ``=F`` for the whole
name.
"""

from __future__ import annotations

COMMENTS = ("#", "%", "//", "'")
"""Beginnings of lines that are comments."""

COLUMN_NAMES: dict[str, tuple[str, ...]] = {
    "displacement_mm": (
        *("extension", "displacement", "deflection", "stroke", "distance", "=crosshead"),
        *("position", "standardweg", "-durchbiegung", "-verformung", "-ausdehnung", "weg"),
        *("-weg", "flèche", "déplacement", "course", "déformation", "flecha", "desplazamiento"),
        *("deflexión", "recorrido", "carrera", "deformación", "distancia", "~挠度", "~位移"),
        *("~变形", "~行程", "=s"),
    ),
    "force_N": (
        *("load", "force", "standardkraft", "-kraft", "-last", "effort", "charge", "fuerza"),
        *("carga", "~力", "~载荷", "~负荷", "~荷载", "=F"),
    ),
    "time_s": ("time", "-zeit", "temps", "tiempo", "~时间", "=t"),
}
"""Names of columns by quantity. Of several in a file, the one with the first term is taken."""

OTHER_COLUMNS = (
    *("stress", "strain", "rate", "speed", "velocity", "command", "setpoint", "target", "error"),
    *("max", "maximum", "minimum", "peak", "break", "at", "cell", "bei", "bruch"),
    *("rupture", "rotura", "contrainte", "tensión", "-spannung", "-geschwindigkeit", "~soll"),
    *("~应力", "~应变", "~速度", "~最大", "~力矩"),
)
"""Terms of columns that are none of these quantities, even if they have one of the names."""

OTHER_UNITS = (
    *("%", "-", "mm/mm", "pa", "kpa", "mpa", "gpa", "psi", "ksi", "n/mm2", "n/mm²", "n/mm"),
    *("v", "mv", "j", "mj", "°c", "hz"),
)
"""Units, in lower case, of columns that are none of these quantities."""

UNIT_SPELLINGS = {
    **{"sec": "s", "second": "s", "seconds": "s", "sekunden": "s", "seg": "s", "秒": "s"},
    **{"inch": "in", "mm": "mm", "毫米": "mm", "厘米": "cm", "µm": "um", "μm": "um"},
    **{"newton": "N", "n": "N", "牛": "N", "牛顿": "N", "kn": "kN", "千牛": "kN", "dan": "daN"},
    **{"lb": "lbf", "lbs": "lbf", "g": "gf", "kg": "kgf", "kp": "kgf", "mm/sec": "mm/s"},
}
"""Other spellings of units, in lower case."""

DIAMETERS = (
    *("diameter", "-durchmesser", "diamètre", "diámetro", "ø", "⌀"),
    *("~直径", "~外径", "~内径"),
)
"""Terms of diameters."""

INNER = (
    *("inner", "inside", "internal", "void", "hole", "bore", "pith", "~innen", "~hohl"),
    *("intérieur", "interne", "interior", "interno", "~内"),
)
"""Terms of the diameter of the void in a specimen."""

OUTER = (
    *("outer", "outside", "external", "specimen", "sample", "stalk", "stem", "~außen", "~halm"),
    *("~proben", "extérieur", "externe", "exterior", "externo", "éprouvette", "tige", "probeta"),
    *("tallo", "muestra", "~外", "~试样", "~茎"),
)
"""Terms of the diameter of a specimen."""

FIXTURE = (
    *("anvil", "indenter", "support", "supports", "nose", "roller", "rollers", "pin", "pins"),
    *("punch", "loading", "load", "probe diameter", "mandrel", "grip", "jaw", "fixture", "cell"),
    *("~finne", "~auflager", "~rolle", "~stempel", "~dorn", "appui", "appuis", "rouleau"),
    *("rouleaux", "poinçon", "panne", "apoyo", "apoyos", "rodillo", "rodillos", "punzón"),
    *("~压头", "~支座", "~支辊", "~压辊"),
)
"""Terms of the diameters of the fixture's parts."""

SPANS = (
    *("span", "-stützweite", "-auflagerabstand", "-stützabstand", "portée", "entraxe"),
    *("distance entre appuis", "distancia entre apoyos", "luz", "~跨距", "~跨度"),
)
"""Terms of the distance between the supports."""

OTHER_SPANS = (
    *("inner", "upper", "load", "loading", "ratio", "depth", "grip", "gauge"),
    *("~einspann", "~innen", "~verhältnis"),
)
"""Terms of lengths that are not the distance between the supports."""

SPEEDS = ("speed", "velocity", "-geschwindigkeit", "vitesse", "velocidad", "~速度")
"""Terms of the speed of the crosshead."""

OTHER_SPEEDS = (
    *("pre", "pretest", "post", "posttest", "return", "approach", "sampling", "retour"),
    *("retorno", "~vorkraft", "~anfahr", "~rück", "~返回"),
)
"""Terms of the crosshead's speed before or after the test."""
