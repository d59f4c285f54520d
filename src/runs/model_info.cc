#include "runs/model_info.h"

#include <nlohmann/json.hpp>

#include "base/checksum.h"
#include "base/text.h"
#include "mujoco/model.h"
#include "os/file.h"

namespace upswing {

std::string ModelInfo::Caption() const {
  return Concat(file.empty() ? "of the training" : Printable(file),
                ", not the built-in one (content ", content, ")");
}

std::string ModelInfo::Text() const {
  return differences.empty() ? Caption() : Concat(Caption(), ": ", Join(differences, ", "));
}

nlohmann::ordered_json ModelInfo::Json() const {
  nlohmann::ordered_json j{{"file", nullptr}, {"content", content}, {"differences", differences}};
  if (!file.empty()) j["file"] = file;
  return j;
}

std::optional<ModelInfo> InfoOfModel(const std::string& mjcf, const std::string& file) {
  if (mjcf.empty()) return std::nullopt;
  const LoadedModel model = LoadModel(mjcf, file.empty() ? "model" : file);
  return ModelInfo{file, ModelContent(mjcf), DifferencesFromBuiltIn(model)};
}

std::string WithModel(const std::string& title, const std::optional<ModelInfo>& model) {
  return model ? Concat(title, ", model ", model->Caption()) : title;
}

std::string ModelContent(const std::string& mjcf) {
  if (mjcf.empty()) return kBuiltIn;
  Checksum checksum;
  checksum.Update(BytesOf(mjcf));
  return checksum.Hex();
}

}  // namespace upswing
