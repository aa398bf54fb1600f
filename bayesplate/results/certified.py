"""The comparison of a fit's draws with a closed form, in words: a line for the screen, a warning where it fails."""

from __future__ import annotations

from bayesplate.posterior.certificate import ALLOWED_ERRORS, Certificate

CHECK = "draws against a closed form"


def certificate_words(certificate: Certificate) -> str:
    """What the comparison found, without saying of what."""
    if not certificate.applies:
        return f"does not apply, {certificate.reason}"
    size = f"{certificate.worst_errors:.1f} Monte Carlo errors ({ALLOWED_ERRORS:g} allowed)"
    return f"agree within {size}" if certificate.passed else f"DO NOT AGREE, the {certificate.worst} is off by {size}"


def certificate_sentence(certificate: Certificate) -> str:
    """One line for the screen."""
    return f"{CHECK}: {certificate_words(certificate)}"


def contradiction(certificate: Certificate) -> tuple[str, ...]:
    """The warning of draws that failed the comparison; nothing of others."""
    if not certificate.applies or certificate.passed:
        return ()
    return (
        f"{certificate_sentence(certificate)}. The draws do not seem to be of the posterior that was asked for: do not "
        "use these constants before a fit with another --seed agrees, and report it if none does",
    )
