"""Class of an animation that notebooks display and that can be saved as GIF, WebP or MP4."""

from __future__ import annotations

import os
from typing import Any

from matplotlib.animation import FFMpegWriter, FuncAnimation, PillowWriter
from matplotlib.figure import Figure
from PIL import Image

from warpdyn.interfaces.exchange.text_files import checked_path, write_in_place

FUNCTION = "animate"
FORMATS = {".gif": "GIF", ".webp": "WEBP", ".mp4": "mp4"}
# Number of colours in a GIF or WebP; the file is half as large as with 256, and lines and text look the same.
PALETTE = 64


class Movie(FuncAnimation):
    """Animation that a notebook displays as the result of a cell, and that `save` writes as GIF, WebP or MP4."""

    def __init__(self, figure: Figure, draw: Any, frames: int, fps: float) -> None:
        self.fps, self.frames = fps, frames
        super().__init__(figure, draw, frames=frames, interval=1000 / fps, cache_frame_data=False)

    def __del__(self) -> None:
        """Suppress matplotlib's warning about an animation that was not drawn, as after `animate` without `save`."""

    def save(self, filename: str | os.PathLike, writer: Any = None, *given: Any, **how: Any) -> None:
        """Write the animation to a file under a temporary name, and rename the file when it is complete.

        Args:
            filename: Path of the file; if `writer` is None, its name must end in ".gif", ".webp" or ".mp4".
            writer: Writer of matplotlib; None: Pillow for GIF and WebP, ffmpeg for MP4.
            given, how: Further arguments of `matplotlib.animation.Animation.save`, such as dpi=80.

        Raises:
            ValueError: If the name has another ending.
            ImportError: If the file is MP4 and ffmpeg is not installed.
            OSError: If the file cannot be written.
        """
        if writer is not None:
            super().save(os.fspath(filename), writer, *given, **how)
            return
        path = checked_path(f"plots.{FUNCTION}().save", filename, *FORMATS)
        kind = FORMATS[path.suffix.lower()]
        if kind == "mp4" and not FFMpegWriter.isAvailable():
            raise ImportError(
                f"plots.{FUNCTION}().save: MP4 needs the program ffmpeg, which is not installed: install it, or save "
                f"{path.with_suffix('.gif').name} or {path.with_suffix('.webp').name}"
            )
        chosen = FFMpegWriter(round(self.fps), extra_args=["-f", "mp4"]) if kind == "mp4" else _Images(self.fps, kind)
        write_in_place(path, lambda name: super(Movie, self).save(name, chosen, *given, **how))

    def _repr_html_(self) -> str:
        return str(self.to_jshtml(fps=max(round(self.fps), 1)))


class _Images(PillowWriter):
    """Writer of an animation as a GIF or WebP with PALETTE colours; the file name may have any ending."""

    def __init__(self, fps: float, kind: str) -> None:
        super().__init__(fps=fps)  # type: ignore[arg-type]  # whole numbers are not needed
        self.kind = kind

    def finish(self) -> None:
        frames: list[Any] = self._frames  # type: ignore[attr-defined]  # attribute of PillowWriter
        first_and_last = Image.new("RGB", (frames[0].width, 2 * frames[0].height))
        first_and_last.paste(frames[0].convert("RGB"))
        first_and_last.paste(frames[-1].convert("RGB"), (0, frames[0].height))
        palette = first_and_last.quantize(PALETTE, method=1)  # 1: maximum coverage, which keeps white
        frames = [frame.convert("RGB").quantize(palette=palette, dither=0) for frame in frames]
        if self.kind == "WEBP":
            # Few colours without losses: 0.4 times the size of a GIF or of a WebP with losses.
            frames, how = [frame.convert("RGB") for frame in frames], {"lossless": True, "method": 4}
        else:
            how = {"optimize": True}
        frames[0].save(
            self.outfile,
            format=self.kind,
            save_all=True,
            append_images=frames[1:],
            duration=round(1000 / self.fps),
            loop=0,
            **how,
        )
