"""How Sphinx builds the site: `python -m docs build`. Nothing on a page is fetched from elsewhere."""

from upright._version import __version__

project = "upright"
author = copyright = "The upright developers"
release = version = __version__

extensions = ["myst_nb", "sphinx.ext.autodoc", "numpydoc", "docs.mathml", "docs.accessible"]
exclude_patterns = ["**/README.md"]
nitpicky = False

html_theme = "furo"
html_title = f"upright {__version__}"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_copy_source = html_show_sourcelink = False
# Both reach 7:1 against their background.
pygments_style = "a11y-high-contrast-light"
pygments_dark_style = "a11y-high-contrast-dark"

# Notebooks are stored as they ran; a test runs them again.
nb_execution_mode = "off"
myst_enable_extensions = ["deflist", "dollarmath", "colon_fence"]
myst_heading_anchors = 3
# Prices and file patterns in a page are no formulas.
myst_dmath_allow_space = myst_dmath_allow_digits = False

autodoc_typehints = "none"
autodoc_member_order = "bysource"
numpydoc_show_class_members = False
html_math_renderer = "mathml"
