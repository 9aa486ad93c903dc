"""Files that the examples of docstrings read, as other tools write them."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import record_files

WAVE = np.sin(np.linspace(0.0, 40.0, 200)) * np.hanning(200)  # an acceleration of peak 1
OPENQUAKE_HAZARD = (
    "#,,,,,\"kind='mean', investigation_time=1.0, imt='PGA'\"\nlon,lat,depth,poe-0.05,poe-0.2,poe-1.0\n"
    "-122.40000,37.80000,0.00000,2.0E-02,3.0E-03,1.0E-04\n-121.90000,37.30000,0.00000,1.0E-02,2.0E-03,1.0E-04\n"
)
SHAKEMAP = """<?xml version="1.0" encoding="UTF-8" standalone="yes"?>
<shakemap_grid xmlns="http://earthquake.usgs.gov/eqcenter/shakemap" event_id="made" shakemap_version="1">
<event event_id="made" magnitude="7.0" depth="8.0" lat="37.5" lon="-122.1" event_description="made for a test" />
<grid_specification lon_min="-122.4" lat_min="37.7" lon_max="-122.2" lat_max="37.9" nlon="2" nlat="2" />
<grid_field index="1" name="LON" units="dd" />
<grid_field index="2" name="LAT" units="dd" />
<grid_field index="3" name="PGA" units="%g" />
<grid_field index="4" name="PSA10" units="%g" />
<grid_data>
-122.4 37.9 21 12
-122.2 37.9 22 13
-122.4 37.7 23 14
-122.2 37.7 24 15
</grid_data>
</shakemap_grid>
"""
R2D = """id,Latitude,Longitude,PlanArea,NumberOfStories,YearBuilt,ReplacementCost,StructureType,OccupancyClass
001,37.80,-122.30,1000,1,1930,250000,W1,RES1
002,37.81,-122.31,2000,5,1990,4000000,C1,COM1
"""
EXPOSURE = """id,lon,lat,taxonomy,number,structural,nonstructural
a1,28.97,41.01,CR/LFINF+DUL/H:5,12,1000,500
a2,28.98,41.02,W+WLI/LWAL+CDM/HEX:1,1,200,20
"""
MODEL = """<?xml version="1.0" encoding="UTF-8"?>
<nrml xmlns="http://openquake.org/xmlns/nrml/0.5">
<exposureModel id="made" category="buildings" taxonomySource="GEM">
<description>made for a test</description>
<conversions><costTypes><costType name="structural" type="aggregated" unit="EUR"/>
<costType name="nonstructural" type="aggregated" unit="EUR"/></costTypes></conversions>
<assets>exposure.csv</assets>
</exposureModel></nrml>
"""
CONDITIONAL_SPECTRUM = """#,,,,"generated_by='OpenQuake engine 3.21.0', site_id=0, lon=0.0, lat=0.1"
poe,stat,period,mea,std
2.00000E-02,mean,0.00000E+00,3.00000E-01,2.70000E-01
2.00000E-02,mean,5.00000E-01,7.00000E-01,3.40000E-01
2.00000E-02,mean,1.00000E+00,4.50000E-01,1.00000E-02
1.00000E-01,mean,0.00000E+00,1.50000E-01,2.70000E-01
1.00000E-01,mean,5.00000E-01,3.20000E-01,3.40000E-01
1.00000E-01,mean,1.00000E+00,2.00000E-01,1.00000E-02
"""
NGA_WEST2 = """Record Sequence Number,EQID,Earthquake Magnitude,ClstD (km),Vs30 (m/s) selected for analysis,\
Lowest Usable Freq - Ave. Component (Hz),File Name (Horizontal 1),File Name (Horizontal 2),T0.100S,T1.000S
1,1,6.0,10,300,0.1,a.AT2,b.AT2,0.3,0.1
2,1,6.0,20,400,0.2,c.AT2,d.AT2,0.2,0.05
3,2,7.0,30,500,-999,e.AT2,f.AT2,0.1,0.05
"""
ESM = """event_id;network_code;station_code;Mw;EMEC_Mw;rup_dist;JB_dist;epi_dist;vs30_m_sec;U_hp;V_hp;rotD50_T0_100;\
rotD50_T1_000
e1;IT;AAA;6.4;6.5;10;8;12;400;0.1;0.1;300;100
e2;IT;BBB;6.0;;10;8;12;400;0.1;0.2;200;50
e3;IT;CCC;5.5;;;8;12;;0.1;0.1;100;20
"""
FILES = {
    "conditional-spectrum-0.csv": CONDITIONAL_SPECTRUM,
    "ngawest2.csv": NGA_WEST2,
    "esm.csv": ESM,
    "RSN6_IMPVALL.I_I-ELC180.AT2": record_files.at2(0.3 * WAVE),
    "XX.STA1..HNN.ASC": record_files.esm(100 * WAVE),
    "station.V2C": record_files.cosmos(100 * WAVE),
    "quake.csv": record_files.text(0.3 * WAVE),
    "hazard_curve-mean-PGA_1.csv": OPENQUAKE_HAZARD,
    "hazard.json": json.dumps(
        {
            "response": {
                "hazardCurves": [
                    {
                        "imt": {"value": name, "display": name},
                        "data": [{"component": "Total", "values": {"xs": [0.05, 0.2, 1.0], "ys": [2e-2, 3e-3, 1e-4]}}],
                    }
                    for name in ("PGA", "SA0P75")
                ]
            }
        }
    ),
    "grid.xml": SHAKEMAP,
    "gmf-data_1.csv": "event_id,gmv_PGA,gmv_SA(1.0),custom_site_id\n0,0.2,0.3,p1\n0,0.3,0.4,p2\n1,0.1,0.2,p1\n",
    "sitemesh_1.csv": "custom_site_id,lon,lat\np1,-122.30,37.80\np2,-122.20,37.80\n",
    "records/EventGrid.csv": "GP_file,Longitude,Latitude\nsite0.csv,-122.30,37.80\nsite1.csv,-122.20,37.80\n",
    "records/site0.csv": "TH_file,factor\nRSN0,1.0\nRSN1,1.2\n",
    "records/site1.csv": "TH_file,factor\nRSN0,0.9\nRSN1,1.1\n",
    **{f"records/RSN{i}.json": json.dumps({"dT": 0.01, "data_x": (0.3 * WAVE).tolist()}) for i in range(2)},
    "intensities/EventGrid.csv": "GP_file,Longitude,Latitude\nsite0.csv,-122.30,37.80\nsite1.csv,-122.20,37.80\n",
    "intensities/site0.csv": "PGA,SA(1.0)\n0.2,0.3\n0.1,0.2\n",
    "intensities/site1.csv": "PGA,SA(1.0)\n0.3,0.4\n0.1,0.1\n",
    "buildings.csv": R2D,
    "exposure.csv": EXPOSURE,
    "exposure_model.xml": MODEL,
    "AnchorageBuildings.geojson": json.dumps(
        {
            "type": "FeatureCollection",
            "features": [
                {
                    "type": "Feature",
                    "id": "7",
                    "properties": {"NumberOfStories": 2, "YearBuilt": 1983, "StructureType": "W1", "PlanArea": 1000},
                    "geometry": {"type": "Point", "coordinates": [-149.1, 61.2]},
                }
            ],
        }
    ),
}


def write_files(folder: Path) -> None:
    """Write the files that examples read into a folder."""
    for name, text in FILES.items():
        path = folder / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)
