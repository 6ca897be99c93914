#include "trihedron/records/options.hpp"

#include "trihedron/records/drift_models.hpp"

namespace trihedron {

std::string drift_model_word(const CalibrationOptions& options) {
  return options.drift_field   ? std::string(kDriftField)
         : options.drift_model ? name_of(*options.drift_model)
                               : std::string(kAutoDriftModel);
}

bool set_drift_model(std::string_view word, CalibrationOptions& options) {
  const std::optional<DriftModelId> named = drift_model_named(word);
  if (!named && word != kAutoDriftModel && word != kDriftField) {
    return false;
  }
  options.drift_field = word == kDriftField;
  options.drift_model = options.drift_field ? std::optional(kLargestDriftModel) : named;
  return true;
}

std::vector<std::string> drift_model_words() {
  std::vector<std::string> words = {std::string(kAutoDriftModel), std::string(kDriftField)};
  for (std::string& name : drift_model_names()) {
    words.push_back(std::move(name));
  }
  return words;
}

std::string drift_model_word_choices() {
  return std::string(kAutoDriftModel) + ", " + std::string(kDriftField) + ", " + drift_model_choices();
}

}  // namespace trihedron
