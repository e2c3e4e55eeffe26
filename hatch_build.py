"""Metadata of a distribution: links to the project's home, and the README with links into it.

The home is named by the environment variable FECONTACT_HOME, which releases set; without it, links
of the README stay relative.
"""

import os
import re
from pathlib import Path

from hatchling.metadata.plugin.interface import MetadataHookInterface

PLACES = {"Homepage": "", "Source": "", "Documentation": "/blob/{tag}/docs/start.md",
          "Changelog": "/blob/{tag}/CHANGELOG.md", "Issues": "/issues"}
# A link of a page, or a picture: ![text](place), without those that begin with a scheme or #.
LINK = re.compile(r"(!?)\[([^\]]*)\]\((?![a-z]+:|#)([^)]+)\)")


class Project(MetadataHookInterface):
    """Fills in `readme` and `urls`."""

    def update(self, metadata):
        """Add what is declared as dynamic."""
        home, tag = os.environ.get("FECONTACT_HOME", "").rstrip("/"), f"v{metadata['version']}"
        text = Path(self.root, "README.md").read_text(encoding="utf-8")
        if home:
            metadata["urls"] = {name: home + place.format(tag=tag)
                                for name, place in PLACES.items()}
            text = LINK.sub(lambda link: f"{link[1]}[{link[2]}]({home}/"
                            f"{'raw' if link[1] else 'blob'}/{tag}/{link[3]})", text)
        metadata["readme"] = {"content-type": "text/markdown", "text": text}
