"""Problem document, in responses and jobs."""

from pydantic import ConfigDict, Field

from hornbill.domain.fields import Model, Param, Params


class Problem(Model):
    """Problem document (application/problem+json): code for programs, text with remedy, and facts as extra members."""

    model_config = ConfigDict(extra="allow")

    type: str = Field(description="URI reference of the problem type.")
    title: str = Field(description="Short title of the code.")
    status: int = Field(description="HTTP status.")
    code: str = Field(description="Code for programs. Stable.")
    detail: str = Field(description="What happened and what to do, with the request that resolves it, if there is one.")
    summary: str = Field(description="`detail` without the request.")
    cause: str | None = Field(
        default=None, description="More specific code of the cause. Stable. Null if `code` is specific enough."
    )
    params: Params = Field(default_factory=dict[str, Param])
