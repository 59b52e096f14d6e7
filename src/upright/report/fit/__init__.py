"""A fit, told: its chapter, tables and pictures, its equations, and what to do next."""
