"""Files of other tools: OpenQuake's NRML and tables, pelicun's demands, tables for pandas."""
