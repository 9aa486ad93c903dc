"""Files of other programs: OpenQuake's NRML and tables, pelicun's demands, tables for pandas."""
