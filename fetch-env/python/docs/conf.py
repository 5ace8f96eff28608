"""Sphinx's settings: `sphinx-build -W docs FOLDER` makes the pages from the docstrings."""

project = "fetch_env"
extensions = ["sphinx.ext.autodoc", "sphinx.ext.napoleon"]
html_theme = "furo"
html_copy_source = False

autodoc_default_options = {"members": True}
autodoc_member_order = "bysource"
autodoc_typehints = "none"
napoleon_google_docstring = True
nitpicky = True
# Other packages' pages are not read, so that no network is needed.
nitpick_ignore_regex = [("py:(class|exc)", r"(gymnasium|stable_baselines3)\..*")]
# What users may not have installed.
autodoc_mock_imports = ["lerobot", "stable_baselines3", "torch"]
