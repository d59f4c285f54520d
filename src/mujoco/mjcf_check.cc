#include "mujoco/mjcf_check.h"

#include <tinyxml2.h>

#include <algorithm>
#include <cmath>
#include <string_view>
#include <vector>

#include "base/error.h"
#include "base/text.h"

namespace upswing {
namespace {

constexpr int kMostElements = 200;  // the built-in model has 15
constexpr int kMostLevels = 10;     // of nesting; the built-in model has 5
constexpr size_t kMostName = 100;   // bytes

constexpr double kLargest = 1e6;  // largest magnitude of a number

/// An element that a model may contain, with its child elements as words. "*": any children and
/// attributes, because CompileModel leaves the element out.
struct Element {
  std::string_view name, children = "";
};

constexpr std::string_view kInBody = "body frame geom joint inertial light camera site";
constexpr Element kElements[] = {
    {"mujoco",
     "compiler option size default worldbody actuator contact asset visual statistic custom sensor "
     "keyframe"},
    {"option", "flag"},
    {"default", "default joint geom site camera light material motor general"},
    {"worldbody", "body frame geom light camera site"},
    {"body", kInBody},
    {"frame", kInBody},
    {"actuator", "motor general"},
    {"contact", "exclude"},
    {"asset", "texture material"},
    {"visual", "*"},
    {"statistic", "*"},
    {"custom", "*"},
    {"sensor", "*"},
    {"keyframe", "*"},
    {"texture", "*"},
    {"material", "*"},
    {"light", "*"},
    {"camera", "*"},
    {"site", "*"}};

/// Attributes with a name or another text, of any element. MuJoCo checks which element has which.
constexpr std::string_view kTexts =
    "name class childclass model joint jointinparent body1 body2 material eulerseq meshdir "
    "texturedir assetdir memory nstack njmax nconmax nkey";
/// Attributes with numbers or kKeywords.
constexpr std::string_view kNumbers =
    // compiler
    "angle autolimits coordinate inertiafromgeom inertiagrouprange balanceinertia boundmass "
    "boundinertia settotalmass discardvisual fusestatic alignfree saveinertial usethread "
    "convexhull fitaabb strippath "
    // option
    "timestep gravity wind magnetic density viscosity integrator solver iterations tolerance "
    "ls_iterations ls_tolerance noslip_iterations noslip_tolerance ccd_iterations ccd_tolerance "
    "jacobian cone impratio "
    // flag
    "contact constraint equality frictionloss limit warmstart eulerdamp refsafe midphase nativeccd "
    "island energy sensor filterparent spring damper actuation "
    "clampctrl fwdinv invdiscrete multiccd autoreset "
    // body and inertial
    "pos quat axisangle xyaxes zaxis euler gravcomp mass diaginertia fullinertia "
    // joint
    "group type axis ref springref stiffness springdamper damping armature limited range margin "
    "solreflimit solimplimit solreffriction solimpfriction actuatorfrclimited actuatorfrcrange "
    // geom
    "size fromto rgba shellinertia contype conaffinity condim priority friction solmix solref "
    "solimp gap fluidshape fluidcoef "
    // motor and general
    "gear ctrllimited ctrlrange forcelimited forcerange dyntype gaintype biastype dynprm gainprm "
    "biasprm";
constexpr std::string_view kKeywords =
    "false true auto enable disable degree radian local Euler RK4 implicit implicitfast PGS CG "
    "Newton dense sparse pyramidal elliptic hinge slide ball free capsule sphere ellipsoid "
    "cylinder box plane none fixed affine";

/// `text` in quotes, cut if it is long.
std::string Quoted(std::string_view text) {
  constexpr size_t kMostShown = 40;
  if (text.size() <= kMostShown) return Concat("\"", Printable(text), "\"");
  return Concat("\"", Printable(text.substr(0, kMostShown)), "…\"");
}

/// Checks one document; error messages begin with `where`.
class Checker {
 public:
  explicit Checker(const std::string& where) : where_(where) {}

  void Check(const std::string& mjcf) {
    tinyxml2::XMLDocument document;
    document.Parse(mjcf.data(), mjcf.size());
    if (document.Error()) {
      Refuse(document.ErrorLineNum(), Concat("not well-formed XML: ", ErrorText(document)));
    }
    for (const auto* node = document.FirstChild(); node != nullptr; node = node->NextSibling()) {
      if (node->ToDeclaration() != nullptr) continue;
      if (count_ > 0 && node->ToElement() != nullptr) {
        Refuse(node->GetLineNum(), Concat("expected one <mujoco>, got ", Quoted(node->Value())));
      }
      CheckNode(*node, nullptr, 1);
    }
    if (count_ == 0) Refuse(1, "expected <mujoco>, got an empty XML document");
  }

 private:
  [[noreturn]] void Refuse(int line, std::string_view why) const {
    throw BadInput(Concat(where_, ":", line, ": ", why));
  }

  /// The parser's error, such as "mismatched element".
  static std::string ErrorText(const tinyxml2::XMLDocument& document) {
    std::string text = document.ErrorName();
    for (const std::string_view prefix : {"XML_ERROR_", "XML_"}) {
      if (text.starts_with(prefix)) text.erase(0, prefix.size());
    }
    std::ranges::transform(text, text.begin(), [](char c) {
      return c == '_' ? ' ' : c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    });
    return text;
  }

  /// Checks an element and its contents; only elements and comments are allowed.
  void CheckNode(const tinyxml2::XMLNode& node, const Element* parent, int level) {
    if (node.ToComment() != nullptr) return;
    const int line = node.GetLineNum();
    const tinyxml2::XMLElement* element = node.ToElement();
    if (element == nullptr) {
      Refuse(line, Concat("expected only elements and comments, got ", Quoted(node.Value())));
    }
    if (++count_ > kMostElements || level > kMostLevels) {
      Refuse(line, Concat("expected at most ", kMostElements, " elements, nested at most ",
                          kMostLevels, " deep"));
    }
    if (element->Name() == std::string_view("include")) {
      Refuse(line, "expected one file without <include>; MuJoCo's mj_saveLastXML writes one");
    }
    const bool is_ignored = parent != nullptr && parent->children == "*";
    const Element& known = is_ignored ? *parent : Find(*element, parent);
    for (const auto* a = element->FirstAttribute(); a != nullptr; a = a->Next()) {
      if (known.children != "*") CheckAttribute(*a, element->Name());
    }
    for (const auto* child = node.FirstChild(); child != nullptr; child = child->NextSibling()) {
      CheckNode(*child, &known, level + 1);
    }
  }

  /// What an element may contain. Throws BadInput if its parent may not contain it.
  const Element& Find(const tinyxml2::XMLElement& element, const Element* parent) const {
    const std::string name = element.Name();
    const std::vector<std::string> expected = Words(parent ? parent->children : "mujoco");
    if (std::ranges::find(expected, name) == expected.end()) {
      const std::string place = parent ? Concat(" in <", element.Parent()->Value(), ">") : "";
      Refuse(element.GetLineNum(),
             Concat("expected ",
                    expected.empty() ? "nothing" : Concat("<", Join(expected, ">, <"), ">"), place,
                    ", got ", Quoted(name), DidYouMean(name.substr(0, kMostName), expected)));
    }
    const auto* known = std::ranges::find(kElements, name, &Element::name);
    static constexpr Element kLeaf{};
    return known == std::end(kElements) ? kLeaf : *known;
  }

  void CheckAttribute(const tinyxml2::XMLAttribute& attribute, std::string_view element) const {
    const int line = attribute.GetLineNum();
    const std::string name = attribute.Name();
    const std::vector<std::string> names = Words(Concat(kTexts, " ", kNumbers));
    if (std::ranges::count(names, name) == 0) {
      Refuse(line, Concat("<", element, "> takes no ", Quoted(name), " here",
                          DidYouMean(name.substr(0, kMostName), names)));
    }
    const std::string_view text = attribute.Value();
    const std::string expected = Expected(name, text);
    if (expected.empty()) return;
    Refuse(line, Concat("<", element, "> ", name, ": expected ", expected, ", got ", Quoted(text)));
  }

  /// A description of the attribute's valid values; empty if `text` is valid.
  static std::string Expected(const std::string& name, std::string_view text) {
    if (std::ranges::count(Words(kTexts), name) > 0) {
      const bool fits = text.size() <= kMostName && Printable(text) == text;
      return fits ? "" : Concat("a name of at most ", kMostName, " bytes");
    }
    const std::vector<std::string> keywords = Words(kKeywords);
    const auto fits = [&](const std::string& word) {
      const auto number = ParseNumber(word);
      return number ? std::abs(*number) <= kLargest : std::ranges::count(keywords, word) > 0;
    };
    const std::vector<std::string> words = Words(text);
    if (!words.empty() && std::ranges::all_of(words, fits)) return "";
    return Concat("numbers within ", FormatNumber(kLargest), " or a keyword of MJCF");
  }

  const std::string& where_;
  int count_ = 0;  // number of elements so far
};

}  // namespace

void CheckMjcf(const std::string& mjcf, const std::string& where) {
  if (mjcf.size() > kMostMjcfBytes) {
    throw BadInput(
        Concat(where, ": expected MJCF of at most ", kMostMjcfBytes, " bytes, got ", mjcf.size()));
  }
  std::string text = mjcf.starts_with("\xef\xbb\xbf") ? mjcf.substr(3) : mjcf;  // byte order mark
  std::ranges::replace_if(
      text, [](char c) { return c == '\t' || c == '\n' || c == '\r'; }, ' ');
  if (Printable(text) != text) {
    throw BadInput(Concat(where, ": expected UTF-8 text without control characters"));
  }
  Checker(where).Check(mjcf);
}

}  // namespace upswing
