"""Description of an optimum: certificate, sensitivities, or the diagnosis of infeasibility."""
