"""Short programs that use a server, each run as `python -m nappe.examples.NAME`.

Without `--server` each starts a server of its own, and ends it. `notebook.ipynb`, in this folder, is for Jupyter.
"""
