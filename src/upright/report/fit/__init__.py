"""Report of a fit: its chapter, tables and pictures, its equations, and what to do next."""
