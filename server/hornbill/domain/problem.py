"""A problem, as every response and job has it."""

from pydantic import ConfigDict, Field

from hornbill.domain.fields import Model, Param, Params


class Problem(Model):
    """application/problem+json: what went wrong, the code to branch on, and what to do."""

    model_config = ConfigDict(extra="allow")

    type: str = Field(description="URI reference of the problem type.")
    title: str = Field(description="Error code as a phrase.")
    status: int = Field(description="HTTP status.")
    code: str = Field(description="Code for programs. Stable.")
    detail: str = Field(description="One sentence with the details.")
    summary: str = Field(description="`detail` without requests for programs.")
    cause: str | None = Field(
        default=None, description="Code of what exactly went wrong. Stable. Null where `code` says all."
    )
    params: Params = Field(default_factory=dict[str, Param])
